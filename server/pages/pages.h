/* The pages, as they lie in server/pages/. */
#pragma once
extern const char page_home[], page_home_end[], page_docs[], page_docs_end[];

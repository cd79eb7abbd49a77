/* The pages, as they lie in server/pages/, and the modules of clients/js/ for pages of others. */
#pragma once
extern const char page_home[], page_home_end[], page_docs[], page_docs_end[];
extern const char module_home[], module_home_end[];
extern const char module_client[], module_client_end[], module_view[], module_view_end[];

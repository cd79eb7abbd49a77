#include "server/pages/pages.h"

#define EMBED(symbol, file)                                                                        \
    __asm__(".section .rodata\n.global " #symbol "\n.global " #symbol "_end\n" #symbol             \
            ":\n.incbin \"" file "\"\n" #symbol "_end:\n.byte 0\n.previous\n")

EMBED(page_home, PAGES_FOLDER "/home.html");
EMBED(module_home, PAGES_FOLDER "/home.js");
EMBED(page_docs, PAGES_FOLDER "/docs.html");
EMBED(module_client, MODULES_FOLDER "/penumbra.js");
EMBED(module_view, MODULES_FOLDER "/penumbra-view.js");

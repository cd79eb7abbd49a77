#include "server/pages/pages.h"

#define PAGE(symbol, file)                                                                         \
    __asm__(".section .rodata\n.global " #symbol "\n.global " #symbol "_end\n" #symbol             \
            ":\n.incbin \"" PAGES_FOLDER "/" file "\"\n" #symbol "_end:\n.byte 0\n.previous\n")

PAGE(page_home, "home.html");
PAGE(page_docs, "docs.html");

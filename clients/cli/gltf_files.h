/* The files that a .gltf on disk consists of. */
#pragma once
#include "clients/cli/http.h"
#include "protocol/limits.h"

struct cli_files {
    struct cli_part *parts; /* sorted by name; the .gltf is one of them */
    uint32_t count;
};

/* Reads which files the .gltf names and where they are. Refuses names that lead out of its folder.
 * Reports errors; returns an enum cli_exit. */
int cli_gltf_files(const char *path, struct cli_files *files);
void cli_files_finish(struct cli_files *files);

/* The id that the server will give these files: the SHA-256 of their bundle (renderer/import). */
bool cli_bundle_id(const struct cli_files *files, char id[PEN_ID_HEX + 1]);

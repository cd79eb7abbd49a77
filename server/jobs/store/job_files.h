/* The files of jobs: jobs/<id>/ in the store. A file is complete or not there: it is written under
 * another name, synced, and renamed. */
#pragma once
#include "server/jobs/store/job_store.h"

/* The folder that holds them, made where it is missing; -1 and what store_write_failed says. */
int job_files_open_root(const char *store, struct pen_error *error);
/* A job's own folder, in the same way. */
int job_files_open(int root, const uint8_t id[PEN_ID_BYTES], struct pen_error *error);
/* Writes bytes as file->name, and fills its size and tag. */
bool job_files_write(
    int folder, struct job_file *file, const void *data, size_t bytes, struct pen_error *error);
/* What a writer of its own has put under job_files_temporary gets its name in the same way. */
#define JOB_FILES_TEMPORARY "unfinished"
/* The bytes are there under that name; not synced. */
bool job_files_put(int folder, const void *data, size_t bytes, struct pen_error *error);
bool job_files_keep(int folder, struct job_file *file, struct pen_error *error);
/* A descriptor of a file that has the size that was recorded; `checked`: and the bytes. -1 and
 * PEN_INTERNAL when it is damaged or gone. */
int job_files_read(int root, const uint8_t id[PEN_ID_BYTES], const struct job_file *file,
    bool checked, struct pen_error *error);
/* Removes what was not finished. */
void job_files_tidy(int folder);
/* Size and tag of a file that is there under file->name; false: it is not. */
bool job_files_find(int folder, struct job_file *file);
void job_files_remove(int root, const uint8_t id[PEN_ID_BYTES]);
/* Removes the folders of jobs for which `exists` is false. */
void job_files_sweep(
    int root, bool (*exists)(void *context, const uint8_t id[PEN_ID_BYTES]), void *context);

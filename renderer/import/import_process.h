/* How penumbra-import is run: one short-lived process per upload.
 *
 *   penumbra-import --mode scene|image --source-id <64 hex> [--memory-mb 2048] [--cpu-seconds 60]
 *       [--output-bytes 4294967296]
 *
 * Inherited descriptors: PEN_IMPORT_SOURCE_FD the uploaded bytes (regular file or memfd,
 * read-only), PEN_IMPORT_OUTPUT_FD where the .pscene goes (empty file or memfd, read-write), and
 * PEN_IMPORT_REPORT_FD a pipe on which it writes exactly one struct pen_error (code PEN_OK: done)
 * before it exits 0. No report, or another exit status: it crashed, and the file is PEN_INVALID (2:
 * the arguments are wrong, nothing was read). When memory or CPU time runs out it still reports
 * PEN_TOO_BIG, and PEN_FULL when the blob is larger than output-bytes; only a report of PEN_OK makes what stands in the output worth reading. A report's
 * pointer is a place in the uploaded glTF document. It puts itself into its sandbox (sandbox.h:
 * rlimits, no_new_privs, Landlock, seccomp) before it reads the first byte; the memory limit counts
 * on top of the mapped upload. The kind of source is found from its magic: glTF binary, zip, bundle
 * (bundle.h), glTF JSON with data URIs; mode image: PNG, JPEG or WebP into a one-image blob. */
#pragma once
#define PEN_IMPORT_SOURCE_FD 3
#define PEN_IMPORT_OUTPUT_FD 4
#define PEN_IMPORT_REPORT_FD 5

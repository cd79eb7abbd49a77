/* Settings of penumbrad. One row per setting gives its flag (--queue-limit), its variable
 * (PENUMBRA_QUEUE_LIMIT), its default, its range and its line of --help. */
#pragma once
#include "protocol/error.h"
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#define CONFIG_TEXT_BYTES 1024
typedef char config_text[CONFIG_TEXT_BYTES];
typedef struct {
    uint64_t bytes;
} config_size; /* written with an optional K, M or G */
typedef struct {
    bool on;
} config_flag;
typedef struct {
    uint32_t index;
} config_choice;

enum config_log_format { CONFIG_LOG_TEXT, CONFIG_LOG_JSON };

struct config {
    config_text listen, admin_listen, store;
    config_size store_limit;
    config_text token_file, tls_cert, tls_key, cors_origin, allow_host, public_url, trusted_proxy;
    config_text worker_path, import_path;
    config_flag insecure;
    config_choice device; /* enum pen_device_choice */
    uint64_t device_index;
    config_flag require_gpu, gl_debug, warm_up;
    config_size gpu_memory;
    uint64_t workers;
    uint64_t queue_limit, client_share;
    config_size result_cache;
    uint64_t jobs, jobs_share, jobs_kept, jobs_keep_s;
    config_size jobs_limit;
    uint64_t hang_timeout_ms, silence_timeout_ms, canary_interval_ms, quarantine_s, scrub_s;
    uint64_t connections, connections_per_address, http_threads;
    uint64_t header_timeout_ms, keep_alive_ms;
    config_size body_rate;
    config_size upload_limit;
    uint64_t uploads, imports, import_timeout_ms, import_cpu_seconds;
    config_size import_memory;
    uint64_t drain_timeout_ms;
    config_choice log_format; /* enum config_log_format */
    config_text config;       /* the file */
    config_flag print_config, print_openapi;
};

/* Defaults, then the file that --config names, then the environment, then the command line. Errors:
 * PEN_INVALID, for an unknown flag, a value out of range or settings that contradict each other, with
 * the file's line where it is its fault; PEN_UNAVAILABLE, a file that cannot be read. */
bool config_read(struct config *config, int argc, char **argv, struct pen_error *error);
/* All settings as a file for --config. */
void config_print(const struct config *config, FILE *to);
/* True when --help or --version stands on the command line; it has then been answered. */
bool config_answer_help(int argc, char **argv);

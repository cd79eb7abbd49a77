/* What penumbrad and penumbra-worker say to each other: one SOCK_SEQPACKET packet per message, with
 * descriptors attached. Both ends come from one build; the version catches a mixed installation. */
#pragma once
#include "protocol/result.h"
#include "server/queue/measure.h"
#include <stddef.h>

#define CHANNEL_VERSION 8u
#define CHANNEL_MAX_JOBS 8   /* that a worker has at a time, being encoded or not */
#define CHANNEL_WORKER_FD 3  /* the worker's end */
#define CHANNEL_ALIVE_MS 500 /* how often a worker says that it is there */
#define CHANNEL_MAX_FDS (2 + PEN_MAX_LIGHTS)

/* --warm-up N: what the worker compiles before it is asked for it. FILL: everything, into the driver's
 * cache of compiled shaders, when nothing else is to be done, or NOW; it then exits, and has no
 * channel. */
enum worker_warm_up {
    WORKER_NO_WARM_UP,
    WORKER_WARM_UP_USUAL,
    WORKER_WARM_UP_FILL,
    WORKER_WARM_UP_FILL_NOW
};

/* How a worker ends that cannot go on; what it had in hand is for another one. */
enum worker_exit {
    WORKER_EXIT_REFUSED = 2, /* it has said why */
    WORKER_EXIT_LOST,        /* the context is lost */
    WORKER_EXIT_PROTOCOL,    /* the daemon is gone, or talks nonsense */
    WORKER_EXIT_MEMORY,      /* no memory is left, of the device's or the machine's */
    WORKER_EXIT_OTHERS       /* the context is lost by another program's fault */
};

enum channel_kind {
    CHANNEL_HELLO = 1, /* worker: the context stands */
    CHANNEL_REFUSED,   /* worker: there is no such device; it then exits */
    CHANNEL_WARM,      /* worker: warmed up */
    CHANNEL_STARTED,   /* worker: the GL thread takes this job */
    CHANNEL_BUSY,      /* worker: there is no room for this job beside what is in progress */
    CHANNEL_TURN,      /* worker: it is alive, and from now on this job has its turns */
    CHANNEL_RENDERED,  /* worker: the GL thread is done with it, encoding follows */
    CHANNEL_PART,      /* worker: the picture so far, as CHANNEL_DONE has it; the job goes on */
    CHANNEL_DONE,     /* worker: the answer; a sealed memfd for each thing that enum measure says */
    CHANNEL_RESIDENT, /* worker: the scenes in GPU memory, when they have changed */
    CHANNEL_ALIVE,    /* worker: its process runs, whatever its GL thread does */
    CHANNEL_JOB,      /* front end: descriptors: the scene's blob, `image_count` images, and the
                          reference's planes when there is something to compare with */
    CHANNEL_CANCEL,   /* front end: nobody waits for this job; it is answered all the same */
    CHANNEL_WANT,     /* front end: the job's picture so far would be taken. Each is answered by one
                          CHANNEL_PART at most, and two without one in between count as one, so that
                          nobody gets more than he takes. No CHANNEL_PART comes after CHANNEL_DONE;
                          one whose job is unknown is ignored. */
    CHANNEL_DROP,     /* front end: the scene was deleted */
    CHANNEL_KINDS
};

struct channel_hello {
    uint32_t pid;
    float create_ms;
    struct pen_device_info device;
};
struct channel_warm {
    float warm_ms;
    uint32_t reserved;
    uint64_t gpu_bytes;
    struct pen_program_counts programs;
};
struct channel_job {
    struct pen_request request;
    uint64_t best_until_ns; /* monotonic; not 0: what there is of the picture is wanted then */
    uint64_t client;        /* with whom its time on the device is shared; 0: a client of its own */
    uint32_t image_count;
    uint32_t measure; /* enum measure */
    uint32_t parts;   /* 1: as if a CHANNEL_WANT followed */
    uint32_t fresh;   /* 1: drawn from its first sample on, whatever there is already */
    uint8_t images[PEN_MAX_LIGHTS][PEN_ID_BYTES]; /* in the order of the descriptors */
};
#define CHANNEL_MAX_RESIDENT 128 /* the ones used last, if there are more */
struct channel_resident {
    uint32_t count, reserved;
    uint8_t scenes[CHANNEL_MAX_RESIDENT][PEN_ID_BYTES];
};
struct channel_turn {
    struct pen_place place; /* of the job */
};
struct channel_drop {
    uint8_t scene[PEN_ID_BYTES];
};

struct channel_message {
    uint32_t version, kind;
    uint64_t job;
    union {
        struct channel_hello hello;
        struct channel_warm warm;
        struct channel_job job_data;
        struct channel_turn turn;
        struct channel_drop drop;
        struct channel_resident resident;
        struct pen_error refused;
        struct pen_result result;
    };
};

struct channel_fds {
    uint32_t count;
    int fd[CHANNEL_MAX_FDS];
};

/* Sends one message; only the bytes that its kind uses travel. `fds` may be NULL; they stay the
 * caller's. False with errno when the peer is gone or (non-blocking) its buffer is full. */
bool channel_send(int socket, const struct channel_message *message, const struct channel_fds *fds);

/* Receives one message; the caller owns the descriptors. Returns 1, 0 at the end of the stream, and
 * -1 with errno: EAGAIN when a non-blocking socket has none, EPROTO for anything that is not a
 * message of this version (descriptors are then closed). */
int channel_receive(int socket, struct channel_message *message, struct channel_fds *fds);
void channel_close_fds(struct channel_fds *fds);

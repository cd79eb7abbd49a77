/* The answer to one render as it gets better: pictures in a multipart/x-mixed-replace that a browser
 * shows one after the other, or records of them as server-sent events. The next picture is asked for
 * when the client's socket has taken the last one, so that slow clients get fewer of them. */
#pragma once
#include "server/http/accept.h"
#include "server/routes/call.h"

struct parts;
struct parts_config {
    struct call *call;
    enum accept_form form;            /* ACCEPT_PARTS or ACCEPT_EVENTS */
    const struct auto_render *choice; /* why "": the method was given */
    /* The render has ended, well or not, while the call is still there. Any thread. */
    void (*ended)(struct call *call, const struct outcome *outcome);
};
struct parts *parts_create(const struct parts_config *config);
/* Waits, with the call deferred, for the first picture or the end; then the call is resumed. `like`
 * says what holds for any waiter: whose share, until when. */
bool parts_submit(struct parts *parts, const struct pen_request *request,
    const uint8_t key[PEN_ID_BYTES], bool shareable, const struct waiter *like,
    struct pen_error *error);
/* There is no need to wait: the picture is known. */
void parts_give(struct parts *parts, struct picture *last);
/* The first picture, when the call was resumed without an error. */
const struct picture *parts_first(const struct parts *parts);
/* Answers with all of them. */
void parts_answer(struct parts *parts);
/* The call ends; what still waits for the render goes when it hears of that. NULL is fine. */
void parts_leave(struct parts *parts);

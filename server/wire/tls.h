/* TLS on a listener's sockets, over OpenSSL: certificates that can be replaced while it runs, and bytes
 * that can be judged before anybody else reads them. */
#pragma once
#include "protocol/error.h"
#include <stddef.h>

struct tls_identity; /* a certificate chain and its key */
struct tls;          /* one connection */

/* Both PEM. Errors: PEN_UNAVAILABLE (unreadable), PEN_INVALID (not a pair). */
struct tls_identity *tls_identity_load(
    const char *cert_file, const char *key_file, struct pen_error *error);
void tls_identity_destroy(struct tls_identity *identity); /* connections keep what they need */

/* The server's side on a non-blocking socket, which stays the caller's; NULL: out of memory. */
struct tls *tls_create(struct tls_identity *identity, int fd);
void tls_destroy(struct tls *tls);
/* As recv and send with MSG_DONTWAIT, but the error is in the value: TLS_AGAIN, TLS_BROKEN. */
#define TLS_AGAIN (-1)
#define TLS_BROKEN (-2)
int64_t tls_read(struct tls *tls, void *to, size_t most);
int64_t tls_write(struct tls *tls, const void *from, size_t bytes);
/* Reading goes on only when the socket takes bytes (in the midst of a handshake). */
bool tls_wants_to_write(const struct tls *tls);
/* Says good-bye; nothing can be written any more. */
void tls_close(struct tls *tls);

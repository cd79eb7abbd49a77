#include "server/wire/tls.h"
#include "protocol/memory.h"
#include <errno.h>
#include <limits.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <stdlib.h>
#include <string.h>

struct tls_identity {
    SSL_CTX *context;
};

struct tls {
    SSL *ssl;
    bool wants_to_write, broken;
};

/* A client that speaks several protocols is told that this one is HTTP/1.1. */
static int choose_protocol(SSL *ssl, const unsigned char **chosen, unsigned char *bytes,
    const unsigned char *offered, unsigned int offered_bytes, void *context)
{
    static const unsigned char own[] = "\x08http/1.1";
    unsigned char *found;
    (void)ssl, (void)context;
    if (SSL_select_next_proto(&found, bytes, own, sizeof own - 1, offered, offered_bytes) !=
        OPENSSL_NPN_NEGOTIATED)
        return SSL_TLSEXT_ERR_ALERT_FATAL;
    *chosen = found;
    return SSL_TLSEXT_ERR_OK;
}

struct tls_identity *tls_identity_load(
    const char *cert_file, const char *key_file, struct pen_error *error)
{
    SSL_CTX *context = SSL_CTX_new(TLS_server_method());
    if (!context)
        abort();
    SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
    SSL_CTX_set_options(context, SSL_OP_NO_RENEGOTIATION | SSL_OP_CIPHER_SERVER_PREFERENCE |
                                     SSL_OP_NO_COMPRESSION | SSL_OP_IGNORE_UNEXPECTED_EOF);
    SSL_CTX_set_mode(context, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                                  SSL_MODE_RELEASE_BUFFERS);
    SSL_CTX_set_alpn_select_cb(context, choose_protocol, NULL);
    const char *at_fault = SSL_CTX_use_certificate_chain_file(context, cert_file) != 1 ? cert_file
                           : SSL_CTX_use_PrivateKey_file(context, key_file, SSL_FILETYPE_PEM) != 1
                               ? key_file
                               : NULL;
    if (at_fault) {
        unsigned long code = ERR_get_error();
        if (ERR_SYSTEM_ERROR(code))
            pen_fail(error, PEN_UNAVAILABLE, "", "%.200s cannot be read: %s.", at_fault,
                strerror(ERR_GET_REASON(code)));
        else
            pen_fail(error, PEN_INVALID, "",
                "The TLS listener cannot start: is %.200s PEM, and the key the certificate's?",
                at_fault);
        ERR_clear_error();
        SSL_CTX_free(context);
        return NULL;
    }
    struct tls_identity *identity = pen_alloc_zero(1, sizeof *identity);
    identity->context = context;
    return identity;
}

void tls_identity_destroy(struct tls_identity *identity)
{
    if (!identity)
        return;
    SSL_CTX_free(identity->context);
    free(identity);
}

struct tls *tls_create(struct tls_identity *identity, int fd)
{
    SSL *ssl = SSL_new(identity->context);
    if (!ssl || SSL_set_fd(ssl, fd) != 1) {
        SSL_free(ssl);
        return NULL;
    }
    SSL_set_accept_state(ssl);
    struct tls *tls = pen_alloc_zero(1, sizeof *tls);
    tls->ssl = ssl;
    return tls;
}

void tls_destroy(struct tls *tls)
{
    if (!tls)
        return;
    SSL_free(tls->ssl);
    free(tls);
}

static int64_t judge(struct tls *tls, int result)
{
    int why = SSL_get_error(tls->ssl, result);
    ERR_clear_error();
    tls->wants_to_write = why == SSL_ERROR_WANT_WRITE;
    if (why == SSL_ERROR_WANT_READ || why == SSL_ERROR_WANT_WRITE)
        return TLS_AGAIN;
    tls->broken = why == SSL_ERROR_SSL || why == SSL_ERROR_SYSCALL;
    return why == SSL_ERROR_ZERO_RETURN ? 0 : TLS_BROKEN;
}

int64_t tls_read(struct tls *tls, void *to, size_t most)
{
    int n = SSL_read(tls->ssl, to, most > INT_MAX ? INT_MAX : (int)most);
    if (n <= 0)
        return judge(tls, n);
    tls->wants_to_write = false;
    return n;
}

int64_t tls_write(struct tls *tls, const void *from, size_t bytes)
{
    int n = SSL_write(tls->ssl, from, bytes > INT_MAX ? INT_MAX : (int)bytes);
    return n > 0 ? n : judge(tls, n) == TLS_AGAIN ? TLS_AGAIN : TLS_BROKEN;
}

bool tls_wants_to_write(const struct tls *tls)
{
    return tls->wants_to_write;
}

void tls_close(struct tls *tls)
{
    if (!tls->broken && SSL_is_init_finished(tls->ssl))
        SSL_shutdown(tls->ssl);
    ERR_clear_error();
}

#include "server/access/guard.h"
#include <arpa/inet.h>
#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#define MAX_NAME 256

/* The name in "name:port" or "[address]:port", without a last dot; false when it is none. */
static bool read_name(const char *host, char name[MAX_NAME])
{
    const char *end = host + strcspn(host, ":");
    bool bracketed = *host == '[';
    if (bracketed) {
        host++;
        end = host + strcspn(host, "]");
        if (*end != ']')
            return false;
    }
    const char *port = bracketed ? end + 1 : end;
    size_t bytes = (size_t)(end - host);
    if (*port && (*port != ':' || strspn(port + 1, "0123456789") != strlen(port + 1)))
        return false;
    if (bytes && !bracketed && host[bytes - 1] == '.')
        bytes--;
    if (!bytes || bytes >= MAX_NAME)
        return false;
    memcpy(name, host, bytes);
    name[bytes] = 0;
    struct in6_addr address;
    return !bracketed || inet_pton(AF_INET6, name, &address) == 1;
}

static bool ends_with(const char *name, const char *end)
{
    size_t n = strlen(name), m = strlen(end);
    return n >= m && !strcasecmp(name + n - m, end);
}

static bool is_listed(const char *names, const char *name)
{
    size_t bytes = strlen(name);
    for (const char *at = names; *at; at += strspn(at, ", ")) {
        size_t n = strcspn(at, ", ");
        if ((n == 1 && *at == '*') || (n == bytes && !strncasecmp(at, name, n)))
            return true;
        at += n;
    }
    return false;
}

static bool is_own_name(const struct guard *guard, const char *name)
{
    struct in6_addr address;
    char machine[MAX_NAME];
    if (inet_pton(AF_INET, name, &address) == 1 || inet_pton(AF_INET6, name, &address) == 1)
        return true;
    if (!strchr(name, '.') || ends_with(name, ".localhost") || ends_with(name, ".local") ||
        ends_with(name, ".internal"))
        return true;
    machine[MAX_NAME - 1] = 0;
    return (!gethostname(machine, sizeof machine - 1) && !strcasecmp(machine, name)) ||
           (*guard->own && !strcasecmp(guard->own, name)) || is_listed(guard->names, name);
}

bool guard_host(const struct guard *guard, const char *host, struct pen_error *error)
{
    char name[MAX_NAME];
    if (!host) /* HTTP/1.0: no browser */
        return true;
    if (!read_name(host, name))
        return pen_fail(error, PEN_MALFORMED, "", "Host is not a name or an address.");
    return is_own_name(guard, name) ||
           pen_fail(error, PEN_MISDIRECTED, "",
               "This service does not answer to the name %.200s. If it should: --allow-host.",
               name);
}

/* Whether a page comes from where the request went: Host may name the scheme's port, Origin does not. */
static bool is_from_here(
    const char *origin, const char *authority, const char *host, const char *scheme)
{
    size_t bytes = (size_t)(authority - origin), length = strlen(authority + 3);
    const char *port = bytes == 5 && !strncasecmp(origin, "https", 5) ? ":443" : ":80";
    if (scheme && (strlen(scheme) != bytes || strncasecmp(origin, scheme, bytes)))
        return false;
    return !strncasecmp(authority + 3, host, length) &&
           (!host[length] || !strcmp(host + length, port));
}

/* Whether a page of this origin is one of this service's own, or of those that may call it. */
static bool may_call(const struct guard *guard, const struct guard_request *request)
{
    const char *origin = request->origin, *host = request->host;
    char name[MAX_NAME];
    if (!strcmp(guard->origin, "*") || (*guard->origin && !strcasecmp(guard->origin, origin)))
        return true;
    const char *authority = strstr(origin, "://");
    if (!authority || !read_name(authority + 3, name))
        return false; /* "null": a sandbox, a file, a redirection */
    return (host && is_from_here(origin, authority, host, request->scheme)) ||
           (strcmp(guard->names, "*") && is_listed(guard->names, name));
}

bool guard_page(
    const struct guard *guard, const struct guard_request *request, struct pen_error *error)
{
    const char *site = request->site;
    bool changes = strcmp(request->method, "GET") && strcmp(request->method, "HEAD") &&
                   strcmp(request->method, "OPTIONS");
    if (!changes || request->authorization)
        return true;
    bool own = site ? !strcmp(site, "same-origin") || !strcmp(site, "none") : !request->origin;
    return own || (request->origin && may_call(guard, request)) ||
           pen_fail(error, PEN_FORBIDDEN, "",
               "Pages of %.200s may not do this here. If they should: --cors-origin.",
               request->origin ? request->origin : "other sites");
}

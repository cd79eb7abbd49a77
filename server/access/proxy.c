#include "server/access/proxy.h"
#include "protocol/memory.h"
#include <arpa/inet.h>
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* IPv4 addresses are taken as they stand in IPv6. */
static bool read_address(const char *text, struct in6_addr *address)
{
    struct in_addr four;
    if (inet_pton(AF_INET6, text, address) == 1)
        return true;
    if (inet_pton(AF_INET, text, &four) != 1)
        return false;
    memset(address, 0, sizeof *address);
    address->s6_addr[10] = address->s6_addr[11] = 0xff;
    memcpy(&address->s6_addr[12], &four, sizeof four);
    return true;
}

/* "10.0.0.0/8", or an address alone. */
static bool read_network(const char *text, size_t bytes, struct in6_addr *network, unsigned *bits)
{
    char copy[64], *end;
    if (bytes >= sizeof copy)
        return false;
    memcpy(copy, text, bytes);
    copy[bytes] = 0;
    char *slash = strchr(copy, '/');
    if (slash)
        *slash++ = 0;
    if (!read_address(copy, network))
        return false;
    unsigned offset = strchr(copy, ':') ? 0 : 96;
    unsigned long n = slash ? strtoul(slash, &end, 10) : 128 - offset;
    if (slash && (!isdigit((unsigned char)*slash) || *end || n > 128 - offset))
        return false;
    *bits = (unsigned)n + offset;
    return true;
}

static bool is_in(const struct in6_addr *address, const struct in6_addr *network, unsigned bits)
{
    unsigned whole = bits / 8, rest = bits % 8;
    if (memcmp(address, network, whole))
        return false;
    unsigned mask = 0xff00u >> rest & 0xff;
    return !rest || (address->s6_addr[whole] & mask) == (network->s6_addr[whole] & mask);
}

bool proxy_is_listed(const char *list, const char *text)
{
    struct in6_addr address, network;
    unsigned bits;
    if (!*list || !read_address(text, &address))
        return false;
    for (const char *at = list; *at;) {
        at += strspn(at, ", ");
        size_t n = strcspn(at, ", ");
        if (n && read_network(at, n, &network, &bits) && is_in(&address, &network, bits))
            return true;
        at += n;
    }
    return false;
}

bool proxy_check_list(const char *list, struct pen_error *error)
{
    struct in6_addr network;
    unsigned bits;
    for (const char *at = list; *at;) {
        at += strspn(at, ", ");
        size_t n = strcspn(at, ", ");
        if (n && !read_network(at, n, &network, &bits))
            return pen_fail(error, PEN_INVALID, "",
                "--trusted-proxy takes addresses and networks, not \"%.*s\".", (int)n, at);
        at += n;
    }
    return true;
}

bool proxy_client(const char *list, const char *forwarded, char client[64])
{
    bool found = false;
    struct in6_addr ignored;
    size_t end = forwarded ? strlen(forwarded) : 0;
    while (end) {
        size_t begin = end;
        while (begin && forwarded[begin - 1] != ',')
            begin--;
        const char *entry = forwarded + begin + strspn(forwarded + begin, " ");
        size_t n = strcspn(entry, ", ");
        char text[64];
        if (n >= sizeof text)
            break;
        memcpy(text, entry, n);
        text[n] = 0;
        if (!read_address(text, &ignored))
            break;
        strcpy(client, text);
        found = true;
        if (!proxy_is_listed(list, text))
            break;
        end = begin ? begin - 1 : 0;
    }
    return found;
}

bool proxy_prefix(const char *path, char prefix[PROXY_PREFIX_BYTES])
{
    size_t bytes = path ? strlen(path) : 0;
    prefix[0] = 0;
    while (bytes && path[bytes - 1] == '/')
        bytes--;
    if (!bytes)
        return true;
    bool fits = bytes < PROXY_PREFIX_BYTES && *path == '/';
    for (size_t i = 0; fits && i < bytes; i++)
        fits = (isalnum((unsigned char)path[i]) || strchr("/-._~", path[i])) &&
               !(path[i] == '/' && path[i + 1] == '/');
    if (!fits)
        return false;
    memcpy(prefix, path, bytes);
    prefix[bytes] = 0;
    return true;
}

const char *proxy_scheme(const char *text)
{
    static const char *const schemes[] = {"http", "https"};
    size_t bytes = text ? strcspn(text, ":, ") : 0;
    for (int i = 0; i < 2; i++)
        if (strlen(schemes[i]) == bytes && !strncasecmp(text, schemes[i], bytes))
            return schemes[i];
    return NULL;
}

bool proxy_split_url(const char *url, char host[PROXY_NAME_BYTES], char prefix[PROXY_PREFIX_BYTES],
    struct pen_error *error)
{
    host[0] = prefix[0] = 0;
    if (!*url)
        return true;
    size_t scheme = !strncasecmp(url, "http://", 7) ? 7 : !strncasecmp(url, "https://", 8) ? 8 : 0;
    size_t name = scheme ? strcspn(url + scheme, ":/") : 0;
    if (!name || name >= PROXY_NAME_BYTES ||
        !proxy_prefix(url + scheme + strcspn(url + scheme, "/"), prefix))
        return pen_fail(error, PEN_INVALID, "",
            "--public-url must look like https://example.org/shadows, not \"%.100s\".", url);
    memcpy(host, url + scheme, name);
    host[name] = 0;
    return true;
}

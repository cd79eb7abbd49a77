/* Settings from flags and variables, the Accept header, tokens, and the quarantine. */
#include "protocol/request.h"
#include "server/http/accept.h"
#include "server/access/auth.h"
#include "server/access/guard.h"
#include "server/access/proxy.h"
#include "server/base/status.h"
#include "server/base/config.h"
#include "server/workers/quarantine.h"
#include "tests/unit/check.h"
#include <sys/stat.h>
#include <unistd.h>

static bool read_flags(struct config *config, const char *a, const char *b, const char *c)
{
    char *argv[] = {"penumbrad", (char *)a, (char *)b, (char *)c, NULL};
    int argc = 1;
    while (argv[argc])
        argc++;
    struct pen_error error = {0};
    bool ok = config_read(config, argc, argv, &error);
    CHECK(ok == (error.code == PEN_OK));
    return ok;
}

static void test_config(void)
{
    static struct config c;
    CHECK(read_flags(&c, NULL, NULL, NULL));
    CHECK_STR(c.listen, "127.0.0.1:8080");
    CHECK(
        c.queue_limit == 64 && c.gpu_memory.bytes == 2u << 30 && !c.require_gpu.on && c.warm_up.on);
    CHECK(read_flags(&c, "--queue-limit=9", "--require-gpu", "--gpu-memory=3G"));
    CHECK(c.queue_limit == 9 && c.require_gpu.on && c.gpu_memory.bytes == 3ull << 30);
    CHECK(read_flags(&c, "--store", "x=y", "--require-gpu=off"));
    CHECK_STR(c.store, "x=y");
    CHECK(read_flags(&c, "--warm-up", "off", "--require-gpu") && !c.warm_up.on && c.require_gpu.on);
    CHECK(read_flags(&c, "--require-gpu", "--warm-up", "on") && c.warm_up.on && c.require_gpu.on);
    setenv("PENUMBRA_QUEUE_LIMIT", "11", 1);
    setenv("PENUMBRA_REQUIRE_GPU", "on", 1);
    CHECK(read_flags(&c, "--require-gpu=off", NULL, NULL));
    CHECK(c.queue_limit == 11 && !c.require_gpu.on); /* the command line wins */
    setenv("PENUMBRA_QUEUE_LIMIT", "eleven", 1);
    CHECK(!read_flags(&c, NULL, NULL, NULL));
    unsetenv("PENUMBRA_QUEUE_LIMIT");
    unsetenv("PENUMBRA_REQUIRE_GPU");
    static const char *const bad[] = {"--queue-limit=0", "--queue-limit=65537",
        "--queue-limit=", "--queue-limit=-1", "--queue-limit= 1", "--queue-limit=1K",
        "--queue-limit", "--gpu-memory=1T", "--gpu-memory=18446744073709551615G",
        "--gpu-memory=1GB", "--device=gpus", "--queue_limit=1", "--", "store", "--tls-cert=x",
        "--require-gpu=perhaps", "--queue-limit=99999999999999999999"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        CHECK(!read_flags(&c, bad[i], NULL, NULL));
    static const struct {
        const char *flag, *value, *message;
    } told[] = {{"--require-gpu", "perhaps", "--require-gpu must be on or off, not \"perhaps\"."},
        {"--port", "80", "There is no setting --port; did you mean \"--listen\"?"},
        {"-p", "80", "\"-p\" is no setting: they look like --queue-limit 64; see --help."},
        {"--queue-limt", "3", "There is no setting --queue-limt; did you mean \"--queue-limit\"?"},
        {"--queue-limit", "--workers", "--queue-limit needs a value."},
        {"--log-format", "xml", "--log-format must be text or json, not \"xml\"."},
        {"--import-memory", "1K",
            "--import-memory must be a whole number from 1M to 1048576G, of bytes or with K, M or "
            "G, not \"1K\"."},
        {"80", NULL, "\"80\" is no setting: they look like --queue-limit 64; see --help."}};
    for (size_t i = 0; i < sizeof told / sizeof *told; i++) {
        char *argv[] = {"penumbrad", (char *)told[i].flag, (char *)told[i].value, NULL};
        struct pen_error error = {0};
        CHECK(!config_read(&c, told[i].value ? 3 : 2, argv, &error));
        CHECK_STR(error.message, told[i].message);
    }
}

static void test_accept(void)
{
    static const struct {
        const char *accept, *type;
        bool allowed;
    } rows[] = {{NULL, "image/png", true}, {"*/*", "image/png", true},
        {"image/*", "image/webp", true}, {"image/png", "image/webp", false},
        {"text/html, image/webp ;q=0.5", "image/webp", true},
        {"image/*, image/png;q=0", "image/png", false}, {"*/*;q=0.1, image/exr", "image/png", true},
        {"IMAGE/PNG", "image/png", true}, {"image/pngx", "image/png", false},
        {"", "image/png", false}, {"image/png;level=1;q=0", "image/png", false},
        {",,,image/png", "image/png", true}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        CHECK(accept_allows(rows[i].accept, rows[i].type) == rows[i].allowed);
    CHECK(accept_form("application/json") == ACCEPT_RECORD);
    CHECK(accept_form("application/json, */*;q=0.5") == ACCEPT_RECORD);
    CHECK(accept_form("*/*") == ACCEPT_PICTURE);
    CHECK(accept_form(NULL) == ACCEPT_PICTURE);
    CHECK(accept_form("") == ACCEPT_PICTURE);
    CHECK(accept_form("image/png, application/json;q=0.5") == ACCEPT_PICTURE);
    CHECK(accept_form("Multipart/X-Mixed-Replace") == ACCEPT_PARTS);
    CHECK(accept_form("multipart/x-mixed-replace, image/webp;q=0.9") == ACCEPT_PARTS);
    CHECK(accept_form("multipart/*, image/*;q=0.1") == ACCEPT_PICTURE);
    CHECK(accept_form("multipart/x-mixed-replace;q=0") == ACCEPT_PICTURE);
    CHECK(accept_form("text/event-stream") == ACCEPT_EVENTS);
    CHECK(accept_form("text/event-stream, application/json;q=0.9") == ACCEPT_EVENTS);
    CHECK(accept_form("text/event-stream, application/json") == ACCEPT_RECORD);
    CHECK(
        accept_form("text/event-stream;q=0.5, application/json;q=0.4, */*;q=0.1") == ACCEPT_EVENTS);
}

/* Every code has a status of its class, and what comes from elsewhere is made safe. */
static void test_codes(void)
{
    for (uint32_t code = PEN_OK + 1; code < PEN_CODES; code++) {
        struct http_status told = http_status_of((enum pen_code)code);
        bool callers = pen_code_blame(code) == PEN_BLAME_CALLER;
        CHECK(told.status / 100 == (callers ? 4u : 5u));
        CHECK_STR(http_status_title(told.status), told.title);
        CHECK(*pen_code_name(code));
    }
    static const uint32_t odd[] = {PEN_UNAUTHORIZED, PEN_TOO_MANY, PEN_CODES, 422, UINT32_MAX};
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
        struct pen_error error = {.code = odd[i]};
        memset(error.message, 'x', sizeof error.message);
        memset(error.pointer, 'x', sizeof error.pointer);
        pen_error_receive(&error);
        CHECK(error.code == PEN_INTERNAL);
        CHECK(strlen(error.message) == sizeof error.message - 1);
        CHECK(strlen(error.pointer) == sizeof error.pointer - 1);
    }
    struct pen_error kept = {.code = PEN_LOST};
    pen_error_receive(&kept);
    CHECK(kept.code == PEN_LOST);
}

/* Lines of a file; what it says wrong, or NULL. */
static const char *read_config(const char *text, struct config *config, const char *flag)
{
    static struct pen_error error;
    char path[] = "/tmp/penumbra-config-XXXXXX", name[80];
    int fd = mkstemp(path);
    CHECK(write(fd, text, strlen(text)) == (ssize_t)strlen(text));
    snprintf(name, sizeof name, "--config=%s", path);
    char *argv[] = {"penumbrad", name, (char *)flag};
    error = (struct pen_error){0};
    bool ok = config_read(config, flag ? 3 : 2, argv, &error);
    close(fd);
    unlink(path);
    return ok ? NULL : error.message;
}

static void test_file(void)
{
    static struct config config, again;
    const char *text = "# ours\n\n  queue-limit =  7\nstore=/a b \r\nrequire-gpu = on\n"
                       "gpu-memory = 3M\nlog-format = json";
    CHECK(!read_config(text, &config, NULL));
    CHECK(config.queue_limit == 7 && config.require_gpu.on && config.gpu_memory.bytes == 3 << 20);
    CHECK(config.log_format.index == CONFIG_LOG_JSON);
    CHECK_STR(config.store, "/a b");
    /* A variable wins over the file, a flag over both. */
    CHECK(!read_config(text, &again, "--queue-limit=9") && again.queue_limit == 9);
    setenv("PENUMBRA_QUEUE_LIMIT", "8", 1);
    CHECK(!read_config(text, &again, NULL) && again.queue_limit == 8);
    CHECK(!read_config(text, &again, "--queue-limit=9") && again.queue_limit == 9);
    unsetenv("PENUMBRA_QUEUE_LIMIT");
    const struct {
        const char *text, *said;
    } wrong[] = {{"\n\nqueue-limit = x\n", ":3: queue-limit must be a whole number"},
        {"queue-limt = 3\n", ":1: There is no setting --queue-limt"},
        {"store\n", ":1: store needs a value"}, {"config = x\n", ":1: config cannot stand in"},
        {"store = a\ntls-cert = b\n", "go together"}, {"\n= 3\n", ":2: There is no setting"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        const char *said = read_config(wrong[i].text, &again, NULL);
        CHECK(said && strstr(said, wrong[i].said));
    }
    struct pen_error error = {0};
    CHECK(!config_read(&again, 2, (char *[]){"penumbrad", "--config=/nowhere/at/all"}, &error));
    CHECK(error.code == PEN_UNAVAILABLE && strstr(error.message, "/nowhere/at/all"));
    /* What is printed reads back as the same. */
    char *printed;
    size_t bytes;
    FILE *memory = open_memstream(&printed, &bytes);
    config_print(&config, memory);
    fclose(memory);
    CHECK(!read_config(printed, &again, NULL));
    memset(config.config, 0, sizeof config.config);
    memset(again.config, 0, sizeof again.config);
    CHECK(!memcmp(&config, &again, sizeof config));
    free(printed);
}

static void test_proxy(void)
{
    const char *list = "10.0.0.0/8, ::1,192.168.1.7,2001:db8::/33";
    static const char *const in[] = {
        "10.1.2.3", "::1", "192.168.1.7", "::ffff:10.9.9.9", "2001:db8:7fff::1", NULL};
    static const char *const out[] = {"11.1.2.3", "::2", "192.168.1.70", "127.0.0.1",
        "2001:db8:8000::1", "", "unknown", "10.1.2.3/8", NULL};
    for (int i = 0; in[i]; i++)
        CHECK(proxy_is_listed(list, in[i]));
    for (int i = 0; out[i]; i++)
        CHECK(!proxy_is_listed(list, out[i]) && !proxy_is_listed("", out[i]));
    CHECK(proxy_check_list(list, NULL) && proxy_check_list("", NULL));
    CHECK(!proxy_check_list("10.0.0.0/33", NULL) && !proxy_check_list("host", NULL));
    char client[64], host[PROXY_NAME_BYTES], prefix[PROXY_PREFIX_BYTES];
    CHECK(proxy_client(list, "6.6.6.6, 7.7.7.7, 10.1.1.1", client));
    CHECK_STR(client, "7.7.7.7"); /* what the client itself may have written is not believed */
    CHECK(proxy_client(list, "7.7.7.7", client) && !proxy_client(list, "<script>", client));
    CHECK(!proxy_client(list, NULL, client) && !proxy_client(list, "", client));
    static const char *const paths[] = {"/a", "/a/b_c~d", "/a/", NULL};
    static const char *const bad[] = {
        "a", "/a//b", "//evil.example", "/a\"b", "/a b", "/a?b", "http://x", NULL};
    for (int i = 0; paths[i]; i++)
        CHECK(proxy_prefix(paths[i], prefix) && prefix[strlen(prefix) - 1] != '/');
    for (int i = 0; bad[i]; i++)
        CHECK(!proxy_prefix(bad[i], prefix) && !*prefix);
    CHECK(proxy_split_url("https://a.example:8443/x/", host, prefix, NULL));
    CHECK_STR(host, "a.example");
    CHECK_STR(prefix, "/x");
    CHECK(!proxy_split_url("a.example", host, prefix, NULL));
    const char *schemes[][2] = {{"https", "https"}, {"HTTP", "http"}, {"https, http", "https"},
        {"http://a.example/x", "http"}, {"https://a", "https"}, {"", NULL}, {NULL, NULL},
        {"ftp", NULL}, {"httpsx", NULL}, {"http s", "http"}};
    for (size_t i = 0; i < sizeof schemes / sizeof *schemes; i++) {
        const char *found = proxy_scheme(schemes[i][0]);
        CHECK(schemes[i][1] ? found && !strcmp(found, schemes[i][1]) : !found);
    }
}

static void test_auth(void)
{
    char path[] = "/tmp/penumbra-tokens-XXXXXX";
    int fd = mkstemp(path);
    static const char text[] =
        "# comment\n\nfirst-token-0123456789\nbob  second-token-0123456789  \n"
        "carol third-token-0123456789 read,admin requests_per_s=2 renders=1 stored_bytes=3M\n";
    CHECK(write(fd, text, sizeof text - 1) == sizeof text - 1);
    struct auth *auth = auth_load(path, NULL);
    struct auth_grant first, bob, carol, none;
    CHECK(auth_check(auth, "Bearer first-token-0123456789", &first) && !*first.name);
    CHECK(first.scopes == (AUTH_READ | AUTH_RENDER | AUTH_UPLOAD));
    CHECK(auth_check(auth, "bearer  second-token-0123456789", &bob) && bob.owner != first.owner);
    CHECK_STR(bob.name, "bob");
    CHECK(auth_check(auth, "Bearer third-token-0123456789", &carol));
    CHECK(carol.scopes == (AUTH_READ | AUTH_ADMIN) && carol.stored_bytes == 3u << 20);
    static const char *const wrong[] = {"Bearer bob", "Bearer first-token-012345678",
        "Bearer first-token-01234567890", "Bearer ", "first-token-0123456789", NULL};
    for (int i = 0; i < 6; i++)
        CHECK(!auth_check(auth, wrong[i], &none) && !none.owner && !none.scopes);
    /* Two at once, then two a second. */
    const uint64_t second = 1000000000;
    struct pen_error many = {0};
    CHECK(auth_count(auth, &carol, second, NULL) && auth_count(auth, &carol, second, NULL));
    CHECK(!auth_count(auth, &carol, second, &many) && many.code == PEN_TOO_MANY);
    CHECK(many.retry_after_s == 1);
    CHECK(auth_count(auth, &carol, second + second / 2, NULL));
    CHECK(!auth_count(auth, &carol, second + second / 2, NULL));
    for (int i = 0; i < 100; i++)
        CHECK(auth_count(auth, &bob, second, NULL));
    CHECK(auth_enter(auth, &carol, NULL) && !auth_enter(auth, &carol, NULL));
    auth_leave(auth, &carol);
    CHECK(auth_enter(auth, &carol, NULL));
    /* Another token of the same name is the same owner; what is wrong changes nothing. */
    static const char other[] = "bob  other-second-token-0123456789\n";
    CHECK(!ftruncate(fd, 0) && pwrite(fd, other, sizeof other - 1, 0) == sizeof other - 1);
    CHECK(auth_reload(auth, path, NULL));
    CHECK(!auth_check(auth, "Bearer second-token-0123456789", &none));
    CHECK(
        auth_check(auth, "Bearer other-second-token-0123456789", &none) && none.owner == bob.owner);
    static const char *const lines[] = {"bob other-second-token-0123456789 write\n",
        "bob other-second-token-0123456789 read,\nx\n",
        "\nbob other-second-token-0123456789 renders=0\n",
        "bob other-second-token-0123456789 renders=-1\n",
        "bob other-second-token-0123456789 renders=1x\n",
        "bob other-second-token-0123456789 stored_bytes=99999999999G\n"};
    for (int i = 0; i < 6; i++) {
        struct pen_error fault = {0};
        CHECK(!ftruncate(fd, 0) && pwrite(fd, lines[i], strlen(lines[i]), 0) > 0);
        CHECK(!auth_reload(auth, path, &fault) && fault.code == PEN_INVALID);
        CHECK(strstr(fault.message, i == 1 || i == 2 ? "Line 2 " : "Line 1 ") != NULL);
        CHECK(auth_check(auth, "Bearer other-second-token-0123456789", &none));
    }
    CHECK(!fchmod(fd, 0644));
    struct pen_error seen = {0};
    CHECK(!auth_reload(auth, path, &seen) && strstr(seen.message, "chmod o-rwx /tmp/penumbra-tok"));
    CHECK(!fchmod(fd, 0640));
    auth_destroy(auth);
    struct pen_error error = {0};
    CHECK(ftruncate(fd, 4) == 0);
    CHECK(!auth_load(path, &error) && error.code == PEN_INVALID);
    CHECK(pwrite(fd, "short\n", 6, 0) == 6);
    CHECK(!auth_load(path, NULL));
    unlink(path);
    error.code = 0;
    CHECK(!auth_load(path, &error) && error.code == PEN_UNAVAILABLE);
    close(fd);
}

static void test_hosts(void)
{
    static const char *const good[] = {"127.0.0.1", "127.0.0.1:8080", "192.0.2.7", "[::1]:80",
        "localhost", "localhost:8080", "a.localhost", "penumbra:80", "render.local", "X.Internal:1",
        "renders.example.com", "Renders.Example.Com.:443", "b.example", NULL};
    static const char *const bad[] = {"evil.example", "localhost.evil.example:8080",
        "127.0.0.1.evil.example", "xrenders.example.com", "renders.example.com.evil.net",
        "local.evil.net", "renders.example", NULL};
    static const char *const odd[] = {
        "", ":80", "a:b", "[::1", "[::1]x", "[evil.example]", ".", NULL};
    const struct guard some = {"renders.example.com, b.example", "own.example", ""},
                       any = {"*", "", ""};
    for (int i = 0; good[i]; i++)
        CHECK(guard_host(&some, good[i], NULL));
    CHECK(guard_host(&some, "own.example:443", NULL) && guard_host(&some, "OWN.example", NULL));
    for (int i = 0; bad[i]; i++) {
        struct pen_error error = {0};
        CHECK(!guard_host(&some, bad[i], &error) && error.code == PEN_MISDIRECTED);
        CHECK(guard_host(&any, bad[i], NULL));
    }
    for (int i = 0; odd[i]; i++) {
        struct pen_error error = {0};
        CHECK(!guard_host(&some, odd[i], &error) && error.code == PEN_MALFORMED);
    }
    CHECK(guard_host(&some, NULL, NULL));
}

static void test_pages(void)
{
    const struct guard none = {"", "", ""},
                       known = {"renders.example.com", "", "https://a.example"},
                       open = {"*", "", "*"};
    const struct {
        struct guard_request request;
        bool none, known, open;
    } rows[] = {
        {{"POST", "h:1", NULL, NULL, NULL}, true, true, true}, /* no browser */
        {{"POST", "h:1", "http://h:1", NULL, NULL}, true, true, true},
        {{"POST", "h:1", "http://h:2", NULL, NULL}, false, false, true},
        {{"POST", "h:1", "null", NULL, NULL}, false, false, true},
        {{"POST", "h:1", "https://a.example", NULL, NULL}, false, true, true},
        {{"POST", "h:1", "https://a.example.evil.net", NULL, NULL}, false, false, true},
        {{"POST", "h:1", "https://renders.example.com", NULL, NULL}, false, true, true},
        {{"POST", "h:1", "http://h:1", "same-origin", NULL}, true, true, true},
        {{"POST", "h:1", "https://elsewhere", "same-origin", NULL}, true, true,
            true}, /* a proxy's */
        {{"POST", "h:1", NULL, "none", NULL}, true, true, true},
        {{"POST", "h:1", NULL, "cross-site", NULL}, false, false, false},
        {{"DELETE", "h:1", "http://h:2", "same-site", NULL}, false, false, true},
        {{"PUT", "h:1", "https://a.example", "cross-site", NULL}, false, true, true},
        {{"POST", "h:1", "http://evil.example", "cross-site", "Bearer x"}, true, true, true},
        {{"GET", "h:1", "http://evil.example", "cross-site", NULL}, true, true, true},
        {{"POST", "h", "https://h", NULL, NULL, "https"}, true, true, true},
        {{"POST", "h", "http://h", NULL, NULL, "https"}, false, false, true},
        {{"POST", "h:443", "https://h", NULL, NULL, "https"}, true, true, true},
        {{"POST", "h:443", "https://h", NULL, NULL, NULL}, true, true, true},
        {{"POST", "h:80", "https://h", NULL, NULL, NULL}, false, false, true},
        {{"POST", "h:80", "http://h", NULL, NULL, NULL}, true, true, true},
        {{"POST", "h:8", "http://h", NULL, NULL, NULL}, false, false, true},
        {{"POST", "hh", "http://h", NULL, NULL, NULL}, false, false, true},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct pen_error error = {0};
        CHECK(guard_page(&none, &rows[i].request, &error) == rows[i].none);
        CHECK(error.code == (rows[i].none ? PEN_OK : PEN_FORBIDDEN));
        CHECK(guard_page(&known, &rows[i].request, NULL) == rows[i].known);
        CHECK(guard_page(&open, &rows[i].request, NULL) == rows[i].open);
    }
}

static void test_quarantine(void)
{
    struct quarantine *q = quarantine_create(100);
    struct pen_request a = {.scene = {1}, .technique = "pcss", .width = 4, .height = 3}, b = a,
                       wide = a, other = a;
    uint32_t left = 0;
    b.scene[0] = 2;
    wide.width++;
    strcpy(other.technique, "vssm");
    CHECK(quarantine_blame(q, &a) == QUARANTINE_NOTHING);
    CHECK(quarantine_check(q, &a, &left) == QUARANTINE_NOTHING && left == 0);
    CHECK(quarantine_blame(q, &b) == QUARANTINE_NOTHING && quarantine_count(q) == 0);
    CHECK(quarantine_blame(q, &a) == QUARANTINE_REQUEST);
    CHECK(quarantine_check(q, &a, &left) == QUARANTINE_REQUEST && left >= 99 && left <= 100);
    a.exposure_ev = 1; /* as likely to end one */
    CHECK(quarantine_check(q, &a, &left) == QUARANTINE_REQUEST);
    /* The scene is drawn otherwise, until that has ended two workers, too. */
    CHECK(quarantine_check(q, &wide, &left) == QUARANTINE_NOTHING);
    CHECK(quarantine_check(q, &other, &left) == QUARANTINE_NOTHING);
    CHECK(quarantine_check(q, &b, &left) == QUARANTINE_NOTHING && quarantine_count(q) == 1);
    CHECK(quarantine_blame(q, &wide) == QUARANTINE_NOTHING);
    CHECK(quarantine_blame(q, &other) == QUARANTINE_SCENE);
    CHECK(quarantine_check(q, &wide, &left) == QUARANTINE_SCENE && left >= 99 && left <= 100);
    CHECK(quarantine_check(q, &b, &left) == QUARANTINE_NOTHING && quarantine_count(q) == 1);
    for (uint8_t i = 0; i < 200; i++) { /* more suspects than there is room for */
        struct pen_request many = {.scene = {3, i}};
        CHECK(quarantine_blame(q, &many) == QUARANTINE_NOTHING);
    }
    CHECK(quarantine_count(q) == 0);
    quarantine_destroy(q);
    q = quarantine_create(0); /* never holds anything back */
    quarantine_blame(q, &a);
    quarantine_blame(q, &a);
    CHECK(quarantine_check(q, &a, &left) == QUARANTINE_NOTHING);
    quarantine_destroy(q);
}

int main(void)
{
    test_config();
    test_accept();
    test_codes();
    test_file();
    test_proxy();
    test_auth();
    test_hosts();
    test_pages();
    test_quarantine();
    CHECK_DONE();
}

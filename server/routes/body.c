#include "server/routes/body.h"
#include "protocol/memory.h"
#include "renderer/import/names.h"
#include "server/http/query.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static bool is_json(const char *type)
{
    size_t length = strcspn(type, "; ");
    return (length == 16 && !strncasecmp(type, "application/json", 16)) ||
           (length > 17 && !strncasecmp(type, "application/", 12) &&
               !strncasecmp(type + length - 5, "+json", 5));
}

static bool is_one_of(const char *type, const char *const *types)
{
    size_t bytes = strcspn(type, "; \t");
    for (; *types; types++)
        if (strlen(*types) == bytes && !strncasecmp(*types, type, bytes))
            return true;
    return false;
}

/* What programs write that do not know a file's type, or know it by another name. The bytes will
 * say; what is surely something else, a web page or a picture of another kind, is refused. */
static bool says_little(const char *type, enum pen_body takes)
{
    static const char *const families[] = {
        "application/", "binary/", "model/", "multipart/x-", NULL};
    static const char *const images[] = {"image/jpg", "image/pjpeg", "image/x-png", NULL};
    for (const char *const *family = families; *family; family++)
        if (!strncasecmp(type, *family, strlen(*family)))
            return true;
    return takes == PEN_BODY_IMAGE_UPLOAD && is_one_of(type, images);
}

static bool is_longer(struct http_exchange *x, uint64_t limit)
{
    return x->content_length != HTTP_UNKNOWN_LENGTH && x->content_length > limit;
}

static bool too_long(struct pen_error *error)
{
    return pen_fail(
        error, PEN_TOO_BIG, "", "A render request has at most %d bytes.", PEN_MAX_JSON_BYTES);
}

/* The keys entry and name; "" when the query does not have them. */
static bool read_keys(struct call_body *body, struct http_exchange *x, enum pen_body takes,
    char entry[PEN_BUNDLE_MAX_NAME + 1], struct pen_error *error)
{
    struct pen_query_pair pairs[HTTP_MAX_PAIRS];
    uint32_t count;
    char *query = x->query ? strdup(x->query) : NULL;
    bool ok = http_split_query(query, pairs, &count, error);
    entry[0] = 0;
    for (uint32_t i = 0; ok && i < count; i++) {
        const char *value = pairs[i].value ? pairs[i].value : "";
        if (takes == PEN_BODY_SCENE_UPLOAD && !strcmp(pairs[i].key, "name"))
            snprintf(body->name, sizeof body->name, "%s", value);
        else if (takes != PEN_BODY_SCENE_UPLOAD || strcmp(pairs[i].key, "entry"))
            ok = pen_fail(error, PEN_INVALID, "",
                takes == PEN_BODY_SCENE_UPLOAD
                    ? "The upload of a scene takes only the keys entry and name."
                    : "The upload of an image takes no keys.");
        else if (!pen_name_tidy(value, strlen(value), entry))
            ok = pen_fail(error, PEN_INVALID, "/entry", "entry must name a file of the upload.");
    }
    free(query);
    return ok;
}

static bool open_upload(struct call_body *body, struct service *s, enum pen_body takes,
    struct http_exchange *x, const char *type, struct pen_error *error)
{
    uint64_t limit = s->config->upload_limit.bytes;
    char entry[PEN_BUNDLE_MAX_NAME + 1];
    if (service_is_draining(s))
        return pen_fail(error, PEN_UNAVAILABLE, "", "The service is shutting down.");
    if (!type || (!is_one_of(type, pen_upload_types(takes)) && says_little(type, takes)))
        type = "application/octet-stream";
    if (!is_one_of(type, pen_upload_types(takes)))
        return pen_fail(error, PEN_UNKNOWN_TYPE, "",
            takes == PEN_BODY_SCENE_UPLOAD
                ? "A scene is model/gltf-binary, model/gltf+json, application/zip or "
                  "multipart/form-data."
                : "An image is image/png, image/jpeg or image/webp.");
    if (is_longer(x, limit))
        return pen_fail(
            error, PEN_TOO_BIG, "", "An upload has at most %llu bytes.", (unsigned long long)limit);
    if (x->content_length != HTTP_UNKNOWN_LENGTH &&
        !store_quota_fits(scene_store_quota(s->store), x->content_length, error))
        return false;
    if (!read_keys(body, x, takes, entry, error))
        return false;
    if (!places_take(s->places, body->client, error))
        return false;
    body->has_place = true;
    http_takes_place(x);
    body->upload = upload_create(s->store, type, entry, limit, error);
    return body->upload != NULL;
}

/* Content-Encoding: none, or gzip. */
static bool read_coding(struct call_body *body, struct http_exchange *x, struct pen_error *error)
{
    const char *coding = http_header(x, "Content-Encoding");
    if (!coding || !strcasecmp(coding, "identity"))
        return true;
    body->unknown_coding = strcasecmp(coding, "gzip") && strcasecmp(coding, "x-gzip");
    if (body->unknown_coding)
        return pen_fail(error, PEN_UNKNOWN_TYPE, "",
            "Of content codings only gzip is read here, not \"%.40s\".", coding);
    body->gunzip = gunzip_create();
    return true;
}

bool body_open(struct call_body *body, struct service *service, enum pen_body takes,
    struct http_exchange *x, struct pen_error *error)
{
    const char *type = http_header(x, "Content-Type");
    if (takes == PEN_BODY_NONE)
        return true;
    if (!read_coding(body, x, error))
        return false;
    if (pen_upload_types(takes)) {
        bool ok = open_upload(body, service, takes, x, type, error);
        if (!ok && error->code != PEN_FULL) /* time does not mend that */
            error->retry_after_s = ROUTES_BUSY_S;
        return ok;
    }
    if (type && !is_json(type))
        return pen_fail(error, PEN_UNKNOWN_TYPE, "", "A render request is application/json.");
    return !is_longer(x, PEN_MAX_JSON_BYTES) || too_long(error);
}

static bool take(void *context, const void *data, size_t bytes, struct pen_error *error)
{
    struct call_body *body = context;
    if (body->upload)
        return upload_add(body->upload, data, bytes, error);
    if (body->text_bytes + bytes > PEN_MAX_JSON_BYTES)
        return too_long(error);
    body->text = pen_grow(body->text, &body->capacity, body->text_bytes + bytes, 1);
    memcpy(body->text + body->text_bytes, data, bytes);
    body->text_bytes += bytes;
    return true;
}

bool body_add(struct call_body *body, const void *data, size_t bytes, struct pen_error *error)
{
    return body->gunzip ? gunzip_add(body->gunzip, data, bytes, take, body, error)
                        : take(body, data, bytes, error);
}

bool body_end(struct call_body *body, struct pen_error *error)
{
    return !body->gunzip || gunzip_end(body->gunzip, error);
}

void body_finish(struct call_body *body, struct service *service)
{
    if (body->has_place)
        places_leave(service->places, body->client);
    upload_destroy(body->upload);
    gunzip_destroy(body->gunzip);
    free(body->text);
}

const char *body_json(const struct call_body *body, size_t *bytes)
{
    *bytes = body->text_bytes ? body->text_bytes : 2;
    return body->text_bytes ? body->text : "{}";
}

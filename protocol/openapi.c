#include "protocol/openapi.h"
#include "protocol/openapi_schema.h"
#include "protocol/request.h"
#include "protocol/routes.h"
#include <stdio.h>
#include <string.h>

#define SCHEMA "#/components/schemas/"
#define EXAMPLE_ID "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"

static void write_ref(struct pen_json *json, const char *key, const char *target)
{
    pen_json_object(json, key);
    pen_json_string(json, "$ref", target);
    pen_json_end(json);
}

/* That of a schema, or NULL. */
static const char *example_of(const char *schema)
{
    static const struct {
        const char *schema, *json;
    } examples[] = {
#define EXAMPLE(name, json) {SCHEMA #name, json},
#include "protocol/examples.def"
#undef EXAMPLE
    };
    for (size_t i = 0; i < sizeof examples / sizeof *examples; i++)
        if (!strcmp(examples[i].schema, schema))
            return examples[i].json;
    return NULL;
}

/* One media type of a "content" object; schema NULL: bytes. */
static void write_media(struct pen_json *json, const char *type, const char *schema)
{
    const char *example = schema ? example_of(schema) : NULL;
    pen_json_object(json, type);
    if (schema)
        write_ref(json, "schema", schema);
    if (example)
        pen_json_raw(json, "example", example);
    pen_json_end(json);
}

/* The same picture as it gets better. */
static void write_parts(struct pen_json *json)
{
    static const char *const forms[][2] = {
        {"multipart/x-mixed-replace",
            "Pictures that get better, each shown in place of the one before; the last is the "
            "plain "
            "answer, byte for byte. A part has no header but its type. An error after the first "
            "picture is a part of type application/problem+json, and the answer is broken off "
            "without the closing boundary."},
        {"text/event-stream",
            "The same as events: `picture` and at the end `done`, whose data is the record, with a "
            "link to the picture that holds for a short while; `problem` when it fails, whose data "
            "is the problem document. Nothing follows `done` and `problem`."},
    };
    for (int i = 0; i < 2; i++) {
        pen_json_object(json, forms[i][0]);
        pen_json_object(json, "schema");
        pen_json_string(json, "type", "string");
        pen_json_string(json, "description", forms[i][1]);
        pen_json_end(json);
        pen_json_end(json);
    }
}

static void write_events(struct pen_json *json, const char *what)
{
    pen_json_object(json, "text/event-stream");
    pen_json_object(json, "schema");
    pen_json_string(json, "type", "string");
    pen_json_string(json, "description", what);
    pen_json_end(json);
    pen_json_end(json);
}

static const char job_events[] =
    "`state`: the job changed its state; its data is the job. `frame`: one more is there; its "
    "data has its `frame`, `bytes`, `href`, and of the job `done` and `total`. Every event has "
    "an id: with the last one in Last-Event-ID, what came after it is sent. The stream ends "
    "with the job, and when nothing is left to tell the answer is 204.";
static const char compare_events[] =
    "As it is measured: `reference`, then a `method` for each, whose data is its entry of the "
    "comparison; `done` at the end, whose data is the comparison; `problem` when it fails, whose "
    "data is the problem document. Nothing follows `done` and `problem`. Links hold for a short "
    "while.";
static const char live_events[] =
    "`stats`, once a second: its data is an object with `unix_s`, `recent` (of the last ten "
    "seconds' renders how many, and `total`, the spread of their times as in /v1/stats) and "
    "`metrics`, every unlabelled number of /metrics by its name. Slow listeners get fewer. The "
    "stream ends when the service shuts down.";

static void write_content(struct pen_json *json, enum pen_body body)
{
    static const char *const schemas[] = {
#define DERIVED(name, writer) [PEN_BODY_##name] = SCHEMA #name,
#define WRITTEN(name) [PEN_BODY_##name] = SCHEMA #name,
#include "protocol/schemas.def"
    };
    pen_json_object(json, "content");
    switch (body) {
    case PEN_BODY_SCENE_UPLOAD:
    case PEN_BODY_IMAGE_UPLOAD:
        for (const char *const *type = pen_upload_types(body); *type; type++)
            write_media(json, *type, NULL);
        break;
    case PEN_BODY_PICTURE:
        for (uint32_t i = 0; i < PEN_FORMATS; i++)
            write_media(json, pen_format_mime[i], NULL);
        break;
    case PEN_BODY_RENDERED:
        for (uint32_t i = 0; i < PEN_FORMATS; i++)
            write_media(json, pen_format_mime[i], NULL);
        write_media(json, "application/json", SCHEMA "Record");
        write_parts(json);
        break;
    case PEN_BODY_FRAME:
        for (uint32_t i = 0; i < PEN_FORMATS; i++)
            write_media(json, pen_format_mime[i], NULL);
        write_media(json, "application/json", SCHEMA "RenderRequest");
        break;
    case PEN_BODY_RESULT:
        for (uint32_t i = 0; i < PEN_FORMATS; i++)
            write_media(json, pen_format_mime[i], NULL);
        write_media(json, "application/json", SCHEMA "Comparison");
        write_media(json, "application/zip", NULL);
        break;
    case PEN_BODY_COMPARED:
        write_media(json, "application/json", SCHEMA "Comparison");
        write_events(json, compare_events);
        break;
    case PEN_BODY_EVENTS:
        write_events(json, job_events);
        break;
    case PEN_BODY_LIVE:
        write_events(json, live_events);
        break;
    case PEN_BODY_THUMBNAIL:
        write_media(json, pen_format_mime[PEN_JPEG], NULL);
        break;
    case PEN_BODY_PAGE:
        write_media(json, "text/html", NULL);
        break;
    case PEN_BODY_MODULE:
        write_media(json, "text/javascript", NULL);
        break;
    case PEN_BODY_ASSET:
        write_media(json, "text/javascript", NULL);
        write_media(json, "text/css", NULL);
        break;
    default:
        write_media(json, "application/json", schemas[body]);
    }
    pen_json_end(json);
}

static void write_image_headers(struct pen_json *json)
{
    static const char *const headers[][2] = {
        {"ETag", "Strong; the same request gives the same image."},
        {"Server-Timing", "Milliseconds per stage."},
        {"X-Penumbra-Choice", "Why this method was taken, when auto was asked for."},
        {"X-Penumbra-History", "Of a session's image: how many before it, and what share of its "
                               "pixels, it rests on. There is no ETag then."},
        {"X-Penumbra-Warning", "What the method could not do; once per warning."},
    };
    pen_json_object(json, "headers");
    for (int i = 0; i < 5; i++) {
        pen_json_object(json, headers[i][0]);
        pen_json_string(json, "description", headers[i][1]);
        pen_json_raw(json, "schema", "{\"type\":\"string\"}");
        pen_json_end(json);
    }
    pen_json_end(json);
}

static void write_response(
    struct pen_json *json, const char *status, const char *description, enum pen_body body)
{
    pen_json_object(json, status);
    pen_json_string(json, "description", description);
    if (body == PEN_BODY_PICTURE || body == PEN_BODY_RENDERED)
        write_image_headers(json);
    if (body != PEN_BODY_NONE)
        write_content(json, body);
    pen_json_end(json);
}

/* Begins a query parameter; its schema follows. */
static void open_query(struct pen_json *json, const char *prefix, const char *name, bool vector)
{
    char text[160];
    pen_json_object(json, NULL);
    snprintf(text, sizeof text, "%s%s", prefix, name);
    pen_json_string(json, "name", text);
    pen_json_string(json, "in", "query");
    if (vector) { /* "1,2,3" */
        pen_json_string(json, "style", "form");
        pen_json_bool(json, "explode", false);
    }
}

static void write_query(
    struct pen_json *json, const char *prefix, const char *name, const char *schema)
{
    open_query(json, prefix, name, false);
    write_ref(json, "schema", schema);
    pen_json_end(json);
}

static void write_row_query(struct pen_json *json, const char *prefix, const struct pen_param *row)
{
    open_query(json, prefix, row->name, row->count > 1);
    pen_openapi_row(json, "schema", row);
    pen_json_end(json);
}

static void write_queries(struct pen_json *json, const char *prefix, struct pen_param_table table)
{
    for (uint32_t r = 0; r < table.count; r++)
        write_row_query(json, prefix, &table.rows[r]);
}

static void write_camera_queries(struct pen_json *json)
{
    struct pen_param_table table = pen_camera_table();
    for (uint32_t r = 0; r < table.count; r++) {
        const struct pen_param *row = &table.rows[r];
        bool orbit = row->applies == PEN_CAMERA_BIT(PEN_CAMERA_ORBIT);
        write_row_query(json, orbit ? "camera.orbit." : "camera.", row);
    }
}

/* One query parameter per name; several methods may share it. */
static void write_technique_queries(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    for (uint32_t t = 0; t < catalogue->count; t++)
        for (uint32_t r = 0; r < catalogue->items[t]->params.count; r++) {
            const struct pen_param *row = &catalogue->items[t]->params.rows[r];
            bool seen = false;
            for (uint32_t before = 0; before < t; before++)
                seen |= pen_param_find(catalogue->items[before]->params, row->name) != NULL;
            if (seen)
                continue;
            open_query(json, "params.", row->name, row->count > 1);
            pen_json_object(json, "schema");
            pen_json_array(json, "anyOf");
            for (uint32_t other = t; other < catalogue->count; other++) {
                const struct pen_param *its =
                    pen_param_find(catalogue->items[other]->params, row->name);
                if (its)
                    pen_openapi_row(json, NULL, its);
            }
            pen_json_end(json);
            pen_json_end(json);
            pen_json_end(json);
        }
}

static void write_request_queries(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    pen_json_object(json, NULL);
    pen_json_string(json, "name", "technique");
    pen_json_string(json, "in", "query");
    write_ref(json, "schema", SCHEMA "TechniqueName");
    pen_json_end(json);
    write_technique_queries(json, catalogue);
    write_queries(json, "", pen_request_table());
    write_queries(json, "", pen_delivery_table());
    write_camera_queries(json);
    write_query(json, "light.", "type", SCHEMA "LightType");
    write_queries(json, "light.", pen_light_table());
    write_query(json, "light.texture.", "image", SCHEMA "Id");
    write_query(json, "light.texture.", "pattern", SCHEMA "LightPattern");
    write_queries(json, "", pen_output_table());
    pen_json_object(json, NULL);
    pen_json_string(json, "name", "request");
    pen_json_string(json, "in", "query");
    pen_json_string(json, "description", "A whole request as JSON, instead of the other keys.");
    write_content(json, PEN_BODY_RenderRequest);
    pen_json_end(json);
}

static void write_parameters(
    struct pen_json *json, const struct pen_route *route, const struct pen_catalogue *catalogue)
{
    const char *const placeholders[][4] = {
        {"{id}", "id", "{\"$ref\":\"" SCHEMA "IdPrefix\"}", "\"" EXAMPLE_ID "\""},
        {"{name}", "name", "{\"$ref\":\"" SCHEMA "TechniqueName\"}", "\"pcss\""},
        {"{file}", "file", "{\"type\":\"string\"}",
            strstr(route->pattern, "/panels/") ? "\"picture.js\"" : "\"main.js\""},
        {"{number}", "number", "{\"type\":\"integer\",\"minimum\":0}", "0"},
    };
    pen_json_array(json, "parameters");
    for (int i = 0; i < 4; i++) {
        if (!strstr(route->pattern, placeholders[i][0]))
            continue;
        pen_json_object(json, NULL);
        pen_json_string(json, "name", placeholders[i][1]);
        pen_json_string(json, "in", "path");
        pen_json_bool(json, "required", true);
        pen_json_raw(json, "schema", placeholders[i][2]);
        pen_json_raw(json, "example", placeholders[i][3]);
        pen_json_end(json);
    }
    if (route->flags & PEN_ROUTE_PAGED) {
        pen_json_raw(json, NULL,
            "{\"name\":\"limit\",\"in\":\"query\",\"schema\":{\"type\":\"integer\",\"minimum\":1}"
            "}");
        pen_json_raw(json, NULL,
            "{\"name\":\"after\",\"in\":\"query\",\"description\":\"The last "
            "id of the page before.\",\"schema\":{\"$ref\":\"" SCHEMA "Id\"}}");
    }
    if (route->flags & PEN_ROUTE_LABELS) {
        pen_json_raw(json, NULL,
            "{\"name\":\"name\",\"in\":\"query\",\"description\":\"Only those whose name has this "
            "in it, whatever its case.\",\"schema\":{\"type\":\"string\"}}");
        pen_json_raw(json, NULL,
            "{\"name\":\"tag\",\"in\":\"query\",\"description\":\"Only those with this "
            "tag.\",\"schema\":{\"type\":\"string\"}}");
    }
    if (route->flags & PEN_ROUTE_STATES)
        pen_json_raw(json, NULL,
            "{\"name\":\"state\",\"in\":\"query\",\"schema\":{\"$ref\":\"" SCHEMA "JobState\"}}");
    if (route->flags & PEN_ROUTE_ASYNC)
        pen_json_raw(json, NULL,
            "{\"name\":\"Prefer\",\"in\":\"header\",\"description\":\"respond-async: a job, "
            "whatever deadline_ms says. Not followed where the answer depends on the caller's "
            "waiting: auto, sessions, answers that get "
            "better.\",\"schema\":{\"type\":\"string\"}}");
    if (route->flags & PEN_ROUTE_KEYED)
        pen_json_raw(json, NULL,
            "{\"name\":\"Idempotency-Key\",\"in\":\"header\",\"description\":\"1 to 255 "
            "characters of your own. The same request with it again makes no second job; another "
            "one is refused with 422.\",\"schema\":{\"type\":\"string\"}}");
    if (route->flags & PEN_ROUTE_ENTRY) {
        pen_json_raw(json, NULL,
            "{\"name\":\"name\",\"in\":\"query\",\"description\":\"What the scene is to be called; "
            "else as its file, where that is said. A scene that has a name keeps it.\",\"schema\":{"
            "\"type\":\"string\"}}");
        pen_json_raw(json, NULL,
            "{\"name\":\"entry\",\"in\":\"query\",\"description\":\"The .glb or .gltf that is "
            "wanted, where a zip or a form holds several. The id is then the SHA-256 of "
            "PENENTR1, the entry's length in 4 bytes from the lowest, 4 zero bytes, the entry "
            "and the upload's own bytes.\",\"schema\":{\"type\":\"string\"}}");
    }
    if (route->flags & PEN_ROUTE_QUERY)
        write_request_queries(json, catalogue);
    pen_json_end(json);
}

/* What the operation is about: the first word of its address behind the version. */
static void write_tag(struct pen_json *json, const struct pen_route *route)
{
    char word[32];
    const char *from = !strncmp(route->pattern, "/v1/", 4) ? route->pattern + 4 : "service";
    snprintf(word, sizeof word, "%.*s", (int)strcspn(from, "/"), from);
    pen_json_array(json, "tags");
    pen_json_string(json, NULL, word);
    pen_json_end(json);
}

static void write_operation(
    struct pen_json *json, const struct pen_route *route, const struct pen_catalogue *catalogue)
{
    char method[8] = "";
    for (uint32_t i = 0; route->method[i] && i + 1 < sizeof method; i++)
        method[i] = (char)(route->method[i] | 0x20);
    pen_json_object(json, method);
    pen_json_string(json, "operationId", route->operation);
    pen_json_string(json, "summary", route->summary);
    write_tag(json, route);
    write_parameters(json, route, catalogue);
    if (route->takes != PEN_BODY_NONE) {
        pen_json_object(json, "requestBody");
        pen_json_bool(json, "required", true);
        write_content(json, route->takes);
        pen_json_end(json);
    }
    pen_json_object(json, "responses");
    if (route->gives == PEN_BODY_NONE || route->flags & PEN_ROUTE_REMOVES)
        write_response(json, "204", "Done.", PEN_BODY_NONE);
    if (route->flags & (PEN_ROUTE_ASYNC | PEN_ROUTE_JOB))
        write_response(
            json, "202", "Accepted; Location says where it can be watched.", PEN_BODY_Job);
    if (route->gives != PEN_BODY_NONE && !(route->flags & PEN_ROUTE_JOB))
        write_response(json, "200",
            route->flags & PEN_ROUTE_CREATES ? "These bytes are stored already." : "The answer.",
            route->gives);
    if (route->flags & PEN_ROUTE_CREATES)
        write_response(json, "201", "Stored; Location says where.", route->gives);
    if (route->flags & PEN_ROUTE_RANGES)
        write_response(json, "206", "The bytes that Range names.", route->gives);
    if (route->flags & PEN_ROUTE_CONDITIONAL)
        write_response(json, "304", "If-None-Match names what this request gives.", PEN_BODY_NONE);
    /* Which of them is said by the problem document; "default" is for generators that know no ranges. */
    write_ref(json, "4XX", "#/components/responses/Problem");
    write_ref(json, "5XX", "#/components/responses/Problem");
    write_ref(json, "default", "#/components/responses/Problem");
    pen_json_end(json);
    if (route->flags & PEN_ROUTE_OPEN) {
        pen_json_array(json, "security");
        pen_json_end(json);
    }
    pen_json_end(json);
}

/* A token is asked for where the service has any. */
static void write_security(struct pen_json *json)
{
    pen_json_array(json, "security");
    pen_json_object(json, NULL);
    pen_json_array(json, "token");
    pen_json_end(json);
    pen_json_end(json);
    pen_json_object(json, NULL);
    pen_json_end(json);
    pen_json_end(json);
}

static void write_security_schemes(struct pen_json *json)
{
    pen_json_object(json, "securitySchemes");
    pen_json_object(json, "token");
    pen_json_string(json, "type", "http");
    pen_json_string(json, "scheme", "bearer");
    pen_json_string(
        json, "description", "One of --token-file; a service without that file asks for none.");
    pen_json_end(json);
    pen_json_end(json);
}

static void write_paths(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    pen_json_object(json, "paths");
    for (uint32_t r = 0; r < PEN_ROUTES; r++) {
        const char *pattern = pen_routes[r].pattern;
        if (r && !strcmp(pen_routes[r - 1].pattern, pattern))
            continue;
        pen_json_object(json, pattern);
        for (uint32_t other = r; other < PEN_ROUTES; other++)
            if (!strcmp(pen_routes[other].pattern, pattern))
                write_operation(json, &pen_routes[other], catalogue);
        pen_json_end(json);
    }
    pen_json_end(json);
}

char *pen_openapi_json(const struct pen_catalogue *catalogue, const char *version)
{
    struct pen_json json = {0};
    pen_json_object(&json, NULL);
    pen_json_string(&json, "openapi", "3.1.0");
    pen_json_object(&json, "info");
    pen_json_string(&json, "title", "penumbra");
    pen_json_string(&json, "summary", "Renders glTF scenes with soft shadows.");
    pen_json_string(&json, "version", version);
    pen_json_end(&json);
    pen_json_array(&json, "servers");
    pen_json_object(&json, NULL);
    pen_json_string(&json, "url", "/");
    pen_json_end(&json);
    pen_json_end(&json);
    write_security(&json);
    write_paths(&json, catalogue);
    pen_json_object(&json, "components");
    write_security_schemes(&json);
    pen_json_object(&json, "schemas");
    pen_openapi_schemas(&json, catalogue);
    pen_json_end(&json);
    pen_json_object(&json, "responses");
    pen_json_object(&json, "Problem");
    pen_json_string(&json, "description", "What went wrong.");
    pen_json_object(&json, "content");
    write_media(&json, "application/problem+json", SCHEMA "Problem");
    pen_json_end(&json);
    pen_json_end(&json);
    pen_json_end(&json);
    pen_json_end(&json);
    pen_json_end(&json);
    return pen_json_finish(&json, NULL);
}

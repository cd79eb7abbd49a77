#include "renderer/import/names.h"
#include "protocol/hex.h"
#include "protocol/memory.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <utf8proc.h>

#define FAKE_PATH "C:/fakepath/"
#define VARIANTS 4
#define BLANKS " \t\r\n"
#define FOLDED (UTF8PROC_CASEFOLD | UTF8PROC_COMPAT | UTF8PROC_IGNORE)

bool pen_name_is_safe(const char *name, size_t bytes)
{
    if (!bytes || bytes > PEN_BUNDLE_MAX_NAME)
        return false;
    size_t part = 0; /* length of the part so far */
    for (size_t i = 0; i <= bytes; i++) {
        unsigned char c = i < bytes ? (unsigned char)name[i] : '/';
        if (c < 0x20 || c == 0x7f || c == '\\' || c == ':')
            return false;
        if (c != '/') {
            part++;
            continue;
        }
        const char *start = name + i - part;
        if (!part || (part == 1 && start[0] == '.') ||
            (part == 2 && start[0] == '.' && start[1] == '.'))
            return false;
        part = 0;
    }
    return true;
}

static bool is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

static void turn_slashes(char *name)
{
    for (; (name = strchr(name, '\\')); name++)
        *name = '/';
}

/* Folds empty parts, "." and "..". *climbs: whether it leads above its root, where it then goes on
 * from. False when it is too long. */
static bool fold(const char *path, char name[PEN_BUNDLE_MAX_NAME + 1], bool *climbs)
{
    size_t out = 0;
    *climbs = false;
    for (const char *part = path, *next; part; part = next) {
        const char *slash = strchr(part, '/');
        next = slash ? slash + 1 : NULL;
        size_t bytes = slash ? (size_t)(slash - part) : strlen(part);
        if ((bytes == 1 && part[0] == '.') || (!bytes && next))
            continue;
        if (bytes == 2 && part[0] == '.' && part[1] == '.') {
            *climbs = *climbs || !out;
            while (out && name[--out] != '/')
                ;
            continue;
        }
        if (out + bytes + 1 > PEN_BUNDLE_MAX_NAME)
            return false;
        if (out)
            name[out++] = '/';
        memcpy(name + out, part, bytes);
        out += bytes;
    }
    name[out] = 0;
    return true;
}

bool pen_name_tidy(const char *given, size_t bytes, char name[PEN_BUNDLE_MAX_NAME + 1])
{
    char whole[2 * PEN_BUNDLE_MAX_NAME + 1];
    if (bytes >= sizeof whole || memchr(given, 0, bytes))
        return false;
    memcpy(whole, given, bytes);
    whole[bytes] = 0;
    turn_slashes(whole);
    const char *from = whole;
    if (!strncasecmp(from, FAKE_PATH, strlen(FAKE_PATH)))
        from += strlen(FAKE_PATH);
    else if (is_letter(from[0]) && from[1] == ':' && from[2] == '/')
        from += 3;
    bool climbs;
    return from[0] != '/' && fold(from, name, &climbs) && !climbs &&
           pen_name_is_safe(name, strlen(name));
}

/* ---- names that are the same to people ---- */

struct pen_name_keys {
    const char *name;
    /* Normal form C; that without regard to case, to width and other compatible forms, and to what
     * is not seen. */
    char *composed, *folded;
    bool doubted;
};

/* The name itself where it is not UTF-8. */
static char *map(const char *name, utf8proc_option_t options)
{
    utf8proc_uint8_t *mapped = NULL;
    if (utf8proc_map((const utf8proc_uint8_t *)name, 0, &mapped,
            UTF8PROC_NULLTERM | UTF8PROC_STABLE | UTF8PROC_COMPOSE | options) >= 0)
        return (char *)mapped;
    size_t bytes = strlen(name) + 1;
    return memcpy(pen_alloc_zero(bytes, 1), name, bytes);
}

void pen_names_init(struct pen_names *index, const char *const *names, uint32_t count)
{
    index->count = count;
    index->keys = pen_alloc_zero(count, sizeof *index->keys);
    for (uint32_t i = 0; i < count; i++)
        index->keys[i] =
            (struct pen_name_keys){names[i], map(names[i], 0), map(names[i], FOLDED), false};
}

void pen_names_doubt(struct pen_names *index, uint32_t number)
{
    index->keys[number].doubted = true;
}

void pen_names_finish(struct pen_names *index)
{
    for (uint32_t i = 0; i < index->count; i++) {
        free(index->keys[i].composed);
        free(index->keys[i].folded);
    }
    free(index->keys);
    *index = (struct pen_names){0, NULL};
}

static const char *last_part(const char *name)
{
    const char *slash = strrchr(name, '/');
    return slash ? slash + 1 : name;
}

static const char *key_of(const struct pen_name_keys *keys, int level)
{
    return level == 0 ? keys->name : level == 1 ? keys->composed : keys->folded;
}

/* The only name that equals `wanted`, as written, composed or folded; `part`: in the last part. */
static int64_t look_up(const struct pen_names *index, const struct pen_name_keys *wanted, bool part)
{
    for (int level = 0; level < 3; level++) {
        const char *sought = key_of(wanted, level);
        int64_t found = PEN_NAME_UNKNOWN;
        for (uint32_t i = 0; i < index->count; i++) {
            const char *key = key_of(&index->keys[i], level);
            if (!strcmp(part ? last_part(key) : key, part ? last_part(sought) : sought))
                found = found == PEN_NAME_UNKNOWN ? (int64_t)i : PEN_NAME_AMBIGUOUS;
        }
        if (found != PEN_NAME_UNKNOWN)
            return found;
    }
    return PEN_NAME_UNKNOWN;
}

static bool is_ascii(char c)
{
    return !((unsigned char)c & 0x80);
}

/* From the first letter beyond ASCII to the last one; what lies before and after it are lengths. */
struct foreign_part {
    size_t before, after, letters;
};

static size_t count_letters(const char *text, size_t bytes)
{
    size_t letters = 0;
    for (size_t i = 0; i < bytes; i++)
        letters += ((unsigned char)text[i] & 0xc0) != 0x80;
    return letters;
}

static struct foreign_part foreign_part(const char *name, size_t bytes)
{
    struct foreign_part part = {0, 0, 0};
    while (part.before < bytes && is_ascii(name[part.before]))
        part.before++;
    while (part.before + part.after < bytes && is_ascii(name[bytes - 1 - part.after]))
        part.after++;
    part.letters = count_letters(name + part.before, bytes - part.before - part.after);
    return part;
}

/* A letter has up to four bytes, each of which was read as one, and the later ones may be ASCII. */
static bool may_be(const char *name, const char *wanted, size_t length, struct foreign_part part)
{
    size_t bytes = strlen(name);
    if (bytes <= part.before + part.after || is_ascii(name[part.before]) ||
        strncmp(name, wanted, part.before) ||
        strcmp(name + bytes - part.after, wanted + length - part.after))
        return false;
    size_t letters = count_letters(name + part.before, bytes - part.before - part.after);
    return letters >= part.letters && letters <= 4 * part.letters;
}

/* The only name in doubt that may be the wanted one. */
static int64_t look_up_doubted(const struct pen_names *index, const char *wanted)
{
    size_t length = strlen(wanted);
    struct foreign_part part = foreign_part(wanted, length);
    int64_t found = PEN_NAME_UNKNOWN;
    if (part.before == length)
        return found;
    for (uint32_t i = 0; i < index->count; i++) {
        if (!index->keys[i].doubted || !may_be(index->keys[i].name, wanted, length, part))
            continue;
        if (found != PEN_NAME_UNKNOWN)
            return PEN_NAME_UNKNOWN;
        found = i;
    }
    return found;
}

/* ---- what a URI may mean ---- */

/* Joins base's folder and the path, and folds "." and ".."; what leads above the upload's root
 * becomes its last part, and *outside true. False when the result is no safe name. */
static bool join(
    const char *base, const char *path, char name[PEN_BUNDLE_MAX_NAME + 1], bool *outside)
{
    char joined[2 * PEN_BUNDLE_MAX_NAME + 2];
    bool climbs;
    size_t n = *outside ? 0 : (size_t)(last_part(base) - base), length = strlen(path);
    if (n + length >= sizeof joined)
        return false;
    memcpy(joined, base, n);
    memcpy(joined + n, path, length + 1);
    if (!fold(joined, name, &climbs))
        return false;
    *outside = *outside || climbs;
    return pen_name_is_safe(name, strlen(name));
}

static bool is_utf8(const char *text)
{
    utf8proc_int32_t letter;
    for (utf8proc_ssize_t bytes; *text; text += bytes)
        if ((bytes = utf8proc_iterate((const utf8proc_uint8_t *)text, -1, &letter)) < 1)
            return false;
    return true;
}

/* What old scripts escape is Latin-1. In place; there is room for twice the bytes. */
static void from_latin_1(char *text)
{
    size_t bytes = strlen(text), out = bytes;
    for (size_t i = 0; i < bytes; i++)
        out += !is_ascii(text[i]);
    text[out] = 0;
    while (bytes--) {
        unsigned char c = (unsigned char)text[bytes];
        text[--out] = (char)(c < 0x80 ? c : 0x80 | (c & 0x3f));
        if (c >= 0x80)
            text[--out] = (char)(0xc0 | c >> 6);
    }
}

/* Copies `bytes` of the URI, decoded or as they are; false when there is a NUL. */
static bool decode(const char *uri, size_t bytes, bool decoded, char *path)
{
    char *start = path;
    for (size_t i = 0; i < bytes; i++) {
        int high = decoded && uri[i] == '%' ? pen_hex_digit(uri[i + 1]) : -1;
        int low = high >= 0 ? pen_hex_digit(uri[i + 2]) : -1;
        *path = low >= 0 ? (char)(high << 4 | low) : uri[i];
        i += low >= 0 ? 2 : 0;
        if (!*path++)
            return false;
    }
    *path = 0;
    if (decoded && !is_utf8(start))
        from_latin_1(start);
    return true;
}

/* A URI as a path; *outside when it is an absolute one on somebody's disk. NULL when it is none. */
static const char *path_of(char *text, bool *outside)
{
    turn_slashes(text);
    if (!strncasecmp(text, "file:", 5))
        text += 5, *outside = true;
    while (*outside && text[0] == '/' && (text[1] == '/' || (is_letter(text[1]) && text[2] == ':')))
        text++;
    if (is_letter(text[0]) && text[1] == ':')
        text += 2, *outside = true;
    *outside = *outside || text[0] == '/';
    const char *colon = strchr(text, ':'), *slash = strchr(text, '/');
    return colon && (!slash || colon < slash) ? NULL : text;
}

static int64_t find(const struct pen_names *index, const char *base, const char *uri, bool loose)
{
    struct pen_name_keys wanted[VARIANTS];
    char names[VARIANTS][PEN_BUNDLE_MAX_NAME + 1];
    bool outside[VARIANTS] = {false};
    bool elsewhere = false; /* as it is meant to be read */
    uint32_t count = 0;
    size_t length = strlen(uri), cut = strcspn(uri, "?#");
    if (length > 4 * PEN_BUNDLE_MAX_NAME)
        return PEN_NAME_ELSEWHERE;
    for (int v = 0; v < VARIANTS; v++) {
        char text[8 * PEN_BUNDLE_MAX_NAME + 1];
        bool whole = v % 2 == 0, decoded = v < 2;
        outside[count] = false;
        if ((!whole && cut == length) || (!decoded && !memchr(uri, '%', length)))
            continue;
        const char *path = NULL;
        if (decode(uri, whole ? length : cut, decoded, text))
            path = path_of(text, &outside[count]);
        if (!path || !join(base, path, names[count], &outside[count]) ||
            (outside[count] && !loose)) {
            elsewhere = elsewhere || v == 0;
            continue;
        }
        wanted[count] = (struct pen_name_keys){
            names[count], map(names[count], 0), map(names[count], FOLDED), false};
        count++;
    }
    int64_t found = PEN_NAME_UNKNOWN;
    for (uint32_t k = 0; k < (loose ? 2 : 1) * count && found == PEN_NAME_UNKNOWN; k++)
        if (k >= count || !outside[k])
            found = look_up(index, &wanted[k % count], k >= count);
    for (uint32_t k = 0; loose && k < count && found == PEN_NAME_UNKNOWN; k++)
        if (!outside[k])
            found = look_up_doubted(index, wanted[k].composed);
    for (uint32_t k = 0; k < count; k++) {
        free(wanted[k].composed);
        free(wanted[k].folded);
    }
    return found == PEN_NAME_UNKNOWN && elsewhere ? PEN_NAME_ELSEWHERE : found;
}

int64_t pen_names_find(const struct pen_names *index, const char *base, const char *uri, bool loose)
{
    char text[4 * PEN_BUNDLE_MAX_NAME + 1];
    int64_t found = find(index, base, uri, loose);
    size_t bytes = strlen(uri), first = strspn(uri, BLANKS);
    if (found >= 0 || !loose || first == bytes || bytes >= sizeof text)
        return found;
    size_t last = bytes;
    while (strchr(BLANKS, uri[last - 1]))
        last--;
    if (last - first == bytes)
        return found;
    memcpy(text, uri + first, last - first); /* without the blanks around it */
    text[last - first] = 0;
    return find(index, base, text, loose);
}

#include "server/gallery/thumbnails.h"
#include "server/gallery/sealed.h"
#include <unistd.h>

#define WIDTH 320
#define HEIGHT 240
#define QUALITY 85

void thumbnail_request(struct pen_request *request, const uint8_t scene[PEN_ID_BYTES],
    const struct pen_catalogue *catalogue)
{
    pen_request_default(request, catalogue);
    for (int i = 0; i < PEN_ID_BYTES; i++)
        request->scene[i] = scene[i];
    request->width = WIDTH;
    request->height = HEIGHT;
    request->output.format = PEN_JPEG;
    request->output.quality = QUALITY;
    request->delivery.priority = PEN_PRIORITY_BATCH;
}

char *thumbnail_read(struct scene_store *store, const uint8_t scene[PEN_ID_BYTES], size_t *bytes)
{
    bool damaged;
    int folder = scene_store_open_folder(store, STORE_SCENES, scene, NULL);
    if (folder < 0)
        return NULL;
    char *data = sealed_read(folder, STORE_THUMBNAIL, THUMBNAIL_BYTES, bytes, &damaged);
    if (damaged && !unlinkat(folder, STORE_THUMBNAIL, 0))
        scene_store_set_thumbnail(store, scene, 0, 0);
    close(folder);
    return data;
}

bool thumbnail_keep(struct scene_store *store, const uint8_t scene[PEN_ID_BYTES], const void *data,
    size_t bytes, struct pen_error *error)
{
    uint64_t size = sealed_bytes(bytes);
    if (!store_quota_claim(scene_store_quota(store), size, error))
        return false;
    int folder = scene_store_open_folder(store, STORE_SCENES, scene, error);
    bool ok = folder >= 0 && sealed_write(folder, STORE_THUMBNAIL, data, bytes, false, error);
    if (folder >= 0)
        close(folder);
    if (ok)
        scene_store_set_thumbnail(store, scene, size, size);
    else
        store_quota_settle(scene_store_quota(store), size, 0);
    return ok;
}

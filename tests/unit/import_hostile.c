/* Every file of a folder (tests/api/hostile_files.py fills it) must be refused by the real binary:
 * a 4xx with a message, in little processor time and memory, and no blob. */
#include "tests/unit/check.h"
#include "tests/unit/import_run.h"
#include "renderer/blob/pscene.h"
#include <dirent.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SECONDS 30.0
#define MEGABYTES 4000
#else
#define SECONDS 4.0 /* ten times what the slowest takes on a busy machine */
#define MEGABYTES 384
#endif

static bool printable(const char *text)
{
    for (; *text; text++)
        if (*text < 0x20 || *text > 0x7e)
            return false;
    return true;
}

int main(void)
{
    DIR *folder = opendir(HOSTILE);
    CHECK(folder);
    int count = 0;
    double slowest = 0;
    long largest = 0;
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
        char path[4096];
        if (entry->d_name[0] == '.')
            continue;
        snprintf(path, sizeof path, "%s/%s", HOSTILE, entry->d_name);
        struct run run = run_importer(path, NULL);
        bool refused = run.status == 0 && run.reported &&
                       pen_code_blame(run.error.code) == PEN_BLAME_CALLER && run.error.message[0] &&
                       printable(run.error.message) && printable(run.error.pointer) && !run.blob;
        if (!refused || run.seconds >= SECONDS || run.memory_mb >= MEGABYTES) {
            fprintf(stderr, "%s: status %d, code %u, %.2f s, %ld MB: %s\n", entry->d_name,
                run.status, run.error.code, run.seconds, run.memory_mb, run.error.message);
            check_failures++;
        }
        slowest = fmax(slowest, run.seconds);
        largest = run.memory_mb > largest ? run.memory_mb : largest;
        free(run.blob);
        count++;
    }
    if (folder)
        closedir(folder);
    printf("%d files; slowest %.2f s, largest %ld MB\n", count, slowest, largest);
    CHECK(count > 150);
    CHECK_DONE();
}

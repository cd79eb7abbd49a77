/* What is known of jobs, in a database and in files: states, counts, events, bounds, keys, ends. */
#include "protocol/request.h"
#include "server/http/range.h"
#include "server/jobs/store/job_files.h"
#include "tests/unit/check.h"
#include <fcntl.h>
#include <pthread.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[] = "/tmp/penumbra-jobs-XXXXXX", path[64];
static const struct job_limits plenty = {100, 100, 1000, 1000, 1 << 30};

static struct job make(uint8_t number, uint64_t client, uint32_t frames)
{
    struct job job = {.client = client, .kind = JOB_SEQUENCE, .frames = frames, .created_s = 1000};
    memset(job.id, 0, sizeof job.id);
    job.id[0] = number;
    return job;
}

static bool add(struct job_store *s, uint8_t number, uint64_t client)
{
    struct job job = make(number, client, 4);
    return job_store_add(s, &job, "{\"a\":1}", NULL, &plenty, NULL);
}

static struct job get(struct job_store *s, uint8_t number)
{
    struct job job = make(number, 0, 0), found = {0};
    CHECK(job_store_get(s, job.id, &found, NULL));
    return found;
}

static bool add_frame(struct job_store *s, uint8_t number, uint32_t frame, uint64_t bytes)
{
    struct job job = make(number, 0, 0);
    struct job_frame row = {.number = frame, .file = {.bytes = bytes, .tag = "abc", .name = "n"}};
    return job_store_add_frame(s, job.id, &row, NULL);
}

static bool go_on(struct job_store *s, uint8_t number, enum job_state state, int64_t expires_s)
{
    struct job job = make(number, 0, 0);
    job.state = state;
    job.ended_s = job_is_over(state) ? expires_s - 1 : 0;
    job.expires_s = job_is_over(state) ? expires_s : 0;
    if (state == JOB_FAILED)
        pen_fail(&job.error, PEN_INVALID, "/camera", "Why, 'it' \"failed\".");
    return job_store_set_state(s, &job, NULL);
}

static struct job_store *fresh(void)
{
    static const char *const endings[] = {"", "-wal", "-shm"};
    struct pen_error error = {0};
    for (int i = 0; i < 3; i++) {
        char name[80];
        snprintf(name, sizeof name, "%s%s", path, endings[i]);
        unlink(name);
    }
    struct job_store *s = job_store_open(path, &error);
    CHECK_STR(error.message, "");
    return s;
}

/* accepted, running, one end; and nothing behind an end. */
static void states(void)
{
    struct job_store *s = fresh();
    static const enum job_state ends[] = {JOB_SUCCESSFUL, JOB_FAILED, JOB_DISMISSED};
    for (uint8_t e = 0; e < 3; e++) {
        CHECK(add(s, e, 7));
        CHECK(get(s, e).state == JOB_ACCEPTED && get(s, e).client == 7);
        CHECK(go_on(s, e, JOB_RUNNING, 0));
        CHECK(go_on(s, e, ends[e], 2000));
        for (int other = 0; other < JOB_STATES; other++)
            CHECK(!go_on(s, e, (enum job_state)other, 3000));
        struct job job = get(s, e);
        CHECK(job.state == ends[e] && job.expires_s == 2000 && job.ended_s == 1999);
        CHECK(job.seq == 3 && job.state_seq == 3);
    }
    CHECK_STR(get(s, 1).error.message, "Why, 'it' \"failed\".");
    CHECK(get(s, 1).error.code == PEN_INVALID);
    CHECK(!add(s, 0, 7)); /* the id is taken */
    job_store_close(s);
    s = job_store_open(path, NULL); /* and all of it is still there */
    CHECK(get(s, 2).state == JOB_DISMISSED);
    job_store_close(s);
}

static void frames_and_their_events(void)
{
    struct job_store *s = fresh();
    struct job_frame frames[8];
    struct job job;
    uint32_t count, before;
    add(s, 1, 7);
    go_on(s, 1, JOB_RUNNING, 0);
    CHECK(add_frame(s, 1, 3, 100) && add_frame(s, 1, 0, 50));
    CHECK(add_frame(s, 1, 3, 999)); /* known already: nothing changes */
    job = get(s, 1);
    CHECK(job.done == 2 && job.bytes == 150 && job.seq == 4 && job.state_seq == 2);
    CHECK(job_store_frames(s, job.id, 0, frames, 8, &count, &before, NULL) && count == 2);
    CHECK(frames[0].number == 3 && frames[0].seq == 3 && frames[1].number == 0);
    CHECK(job_store_frames(s, job.id, 3, frames, 8, &count, &before, NULL) && count == 1);
    CHECK(before == 1);
    CHECK(job_store_frames(s, job.id, 4, frames, 8, &count, &before, NULL) && count == 0);
    CHECK(job_store_frames(s, job.id, 0, frames, 1, &count, NULL, NULL) && count == 1);
    CHECK(job_store_frame(s, job.id, 0, frames, NULL) && frames[0].file.bytes == 50);
    struct pen_error error = {0};
    CHECK(!job_store_frame(s, job.id, 2, frames, &error) && error.code == PEN_NOT_FOUND);
    job.state = JOB_SUCCESSFUL;
    job.result = (struct job_file){200, "tag", "sequence.zip"};
    CHECK(job_store_set_state(s, &job, NULL));
    CHECK(get(s, 1).bytes == 350);
    job_store_close(s);
}

static uint32_t code_of(struct job_store *s, uint8_t number, uint64_t client,
    const struct job_limits *limits, uint32_t *retry_s)
{
    struct job job = make(number, client, 1);
    struct pen_error error = {0};
    job_store_add(s, &job, "{}", NULL, limits, &error);
    *retry_s = error.retry_after_s;
    return error.code;
}

static void bounds(void)
{
    struct job_store *s = fresh();
    struct job_limits few = {
        .active = 3, .active_per_client = 2, .kept = 6, .kept_per_client = 4, .bytes = 1000};
    uint32_t retry_s;
    CHECK(code_of(s, 1, 7, &few, &retry_s) == PEN_OK && code_of(s, 2, 7, &few, &retry_s) == PEN_OK);
    CHECK(code_of(s, 3, 7, &few, &retry_s) == PEN_TOO_MANY);
    CHECK(code_of(s, 4, 8, &few, &retry_s) == PEN_OK);
    CHECK(code_of(s, 5, 9, &few, &retry_s) == PEN_UNAVAILABLE);
    for (uint8_t i = 1; i < 5; i++)
        if (i != 3)
            go_on(s, i, JOB_SUCCESSFUL, 1500 + i);
    CHECK(code_of(s, 6, 7, &few, &retry_s) == PEN_OK && go_on(s, 6, JOB_FAILED, 1600));
    CHECK(code_of(s, 7, 7, &few, &retry_s) == PEN_OK && go_on(s, 7, JOB_FAILED, 1400));
    CHECK(code_of(s, 8, 7, &few, &retry_s) == PEN_TOO_MANY); /* has four */
    CHECK(retry_s == 400); /* made at 1000, the next goes at 1400 */
    CHECK(code_of(s, 9, 8, &few, &retry_s) == PEN_OK);
    CHECK(code_of(s, 10, 9, &few, &retry_s) == PEN_UNAVAILABLE); /* there are six */
    few.kept = 100;
    CHECK(code_of(s, 11, 9, &few, &retry_s) == PEN_OK);
    add_frame(s, 9, 0, 1000);
    CHECK(code_of(s, 12, 10, &few, &retry_s) == PEN_UNAVAILABLE && retry_s == 400);
    job_store_close(s);
}

static void pages(void)
{
    struct job_store *s = fresh();
    struct job jobs[4];
    for (uint8_t i = 1; i <= 6; i++)
        add(s, i, i % 2 ? 7 : 8);
    go_on(s, 3, JOB_RUNNING, 0);
    struct job_page page = {.state = JOB_STATES, .jobs = jobs, .most = 4};
    CHECK(job_store_list(s, &page, NULL) && page.count == 4 && page.total == 6);
    CHECK(jobs[0].id[0] == 6 && jobs[3].id[0] == 3);
    struct job_page second = {
        .state = JOB_STATES, .jobs = jobs, .most = 4, .before = make(3, 0, 0).id};
    struct job before = make(3, 0, 0);
    second.before = before.id;
    CHECK(job_store_list(s, &second, NULL) && second.count == 2 && jobs[1].id[0] == 1);
    struct job_page own = {.client = 7, .state = JOB_ACCEPTED, .jobs = jobs, .most = 4};
    CHECK(job_store_list(s, &own, NULL) && own.count == 2 && jobs[0].id[0] == 5);
    uint8_t(*ids)[PEN_ID_BYTES];
    uint32_t count;
    go_on(s, 4, JOB_DISMISSED, 2000);
    CHECK(job_store_active(s, &ids, &count, NULL) && count == 5 && ids[0][0] == 1);
    free(ids);
    char *body = job_store_body(s, before.id);
    CHECK_STR(body, "{\"a\":1}");
    free(body);
    job_store_close(s);
}

static void keys(void)
{
    struct job_store *s = fresh();
    struct job job = make(1, 7, 1);
    struct job_key key = {.client = 7, .text = "k'ey", .print = {1}, .expires_s = 2000};
    bool found, has_job;
    uint8_t id[PEN_ID_BYTES];
    CHECK(job_store_find_key(s, &key, 1000, &found, &has_job, id, NULL) && !found);
    CHECK(job_store_add(s, &job, "{}", &key, &plenty, NULL));
    CHECK(job_store_find_key(s, &key, 9000, &found, &has_job, id, NULL) && found && has_job);
    CHECK(id[0] == 1);                                        /* as long as the job is there */
    struct job second = make(2, 7, 1), third = make(3, 7, 1); /* asked for at the same time */
    CHECK(job_store_add(s, &second, "{}", &key, &plenty, NULL) && second.id[0] == 1);
    struct job_key other = key;
    struct pen_error error = {0};
    other.print[0] = 2;
    CHECK(!job_store_add(s, &third, "{}", &other, &plenty, &error) && error.code == PEN_INVALID);
    memset(&error, 0, sizeof error);
    CHECK(
        !job_store_get(s, third.id, &job, NULL) && !job_store_get(s, make(2, 0, 0).id, &job, NULL));
    job = make(1, 7, 1);
    CHECK(!job_store_find_key(s, &other, 1000, &found, &has_job, id, &error));
    CHECK(error.code == PEN_INVALID);
    other.client = 8; /* somebody else's */
    CHECK(job_store_find_key(s, &other, 1000, &found, &has_job, id, NULL) && !found);
    CHECK(job_store_keep_key(s, &other, NULL));
    CHECK(job_store_find_key(s, &other, 1999, &found, &has_job, id, NULL) && found && !has_job);
    CHECK(job_store_find_key(s, &other, 2000, &found, &has_job, id, NULL) && !found);
    CHECK(job_store_remove(s, job.id, NULL));
    CHECK(job_store_find_key(s, &key, 1000, &found, &has_job, id, NULL) && !found);
    for (int i = 0; i < 1100; i++) { /* what one client can pile up */
        char text[16];
        snprintf(text, sizeof text, "%d", i);
        struct job_key next = {.client = 9, .text = text, .expires_s = 3000 + i};
        CHECK(job_store_keep_key(s, &next, NULL));
    }
    struct job_key first = {.client = 9, .text = "0"}, last = {.client = 9, .text = "1099"};
    CHECK(job_store_find_key(s, &first, 0, &found, &has_job, id, NULL) && !found);
    CHECK(job_store_find_key(s, &last, 0, &found, &has_job, id, NULL) && found);
    job_store_close(s);
}

static void ends(void)
{
    struct job_store *s = fresh();
    uint8_t id[PEN_ID_BYTES];
    struct job_numbers numbers;
    for (uint8_t i = 1; i <= 3; i++) {
        add(s, i, 7);
        add_frame(s, i, 0, 10);
    }
    go_on(s, 1, JOB_SUCCESSFUL, 1300);
    go_on(s, 2, JOB_FAILED, 1200);
    CHECK(!job_store_expire(s, 1199, id));
    CHECK(job_store_expire(s, 1300, id) && id[0] == 2);
    CHECK(job_store_expire(s, 1300, id) && id[0] == 1);
    CHECK(!job_store_expire(s, INT64_MAX, id)); /* the third is not over */
    CHECK(job_store_read(s, &numbers, NULL) && numbers.bytes == 10);
    CHECK(numbers.jobs[JOB_ACCEPTED] == 1 && numbers.jobs[JOB_SUCCESSFUL] == 0);
    job_store_close(s);
}

/* ---- from many threads ---- */

static void *add_frames(void *context)
{
    struct job_store *s = context;
    for (uint32_t i = 0; i < 40; i++)
        CHECK(add_frame(s, 1, i, 1));
    return NULL;
}

static void threads(void)
{
    struct job_store *s = fresh();
    pthread_t ids[4];
    add(s, 1, 7);
    for (int i = 0; i < 4; i++)
        pthread_create(&ids[i], NULL, add_frames, s);
    for (int i = 0; i < 4; i++)
        pthread_join(ids[i], NULL);
    struct job job = get(s, 1);
    CHECK(job.done == 40 && job.bytes == 40 && job.seq == 41);
    job_store_close(s);
}

/* ---- damage ---- */

static void write_file(const char *text)
{
    FILE *file = fopen(path, "w");
    for (int i = 0; i < 2000; i++)
        fputs(text, file);
    fclose(file);
}

static void damage(void)
{
    struct pen_error error = {0};
    job_store_close(fresh());
    write_file("no database ");
    CHECK(!job_store_open(path, &error) && error.code == PEN_UNAVAILABLE);
    CHECK(strstr(error.message, "damaged"));
    struct job_store *s = fresh();
    for (uint8_t i = 0; i < 100; i++)
        add(s, i, 7);
    job_store_close(s);
    int fd = open(path, O_WRONLY); /* a page in the middle */
    struct stat status;
    fstat(fd, &status);
    char junk[4096];
    memset(junk, 0x5a, sizeof junk);
    CHECK(pwrite(fd, junk, sizeof junk, status.st_size / 8192 * 4096) == sizeof junk);
    close(fd);
    memset(&error, 0, sizeof error);
    CHECK(!job_store_open(path, &error) && strstr(error.message, "damaged"));
    unlink(path);
    memset(&error, 0, sizeof error);
    CHECK(mkdir(path, 0700) == 0 && !job_store_open(path, &error) && *error.message);
    rmdir(path);
}

/* ---- files ---- */

static void files(void)
{
    struct pen_error error = {0};
    struct job_file file = {.name = "000001.png"}, again = {.name = "000001.png"};
    struct job job = make(1, 7, 1);
    int root = job_files_open_root(folder, &error);
    int own = job_files_open(root, job.id, &error);
    CHECK(root >= 0 && own >= 0);
    CHECK(job_files_write(own, &file, "abc", 3, &error));
    CHECK(file.bytes == 3);
    CHECK_STR(file.tag, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    CHECK(job_files_find(own, &again) && !strcmp(again.tag, file.tag));
    int fd = job_files_read(root, job.id, &file, true, &error);
    CHECK(fd >= 0);
    close(fd);
    file.bytes = 4; /* shorter than was recorded */
    CHECK(job_files_read(root, job.id, &file, false, &error) < 0 && error.code == PEN_INTERNAL);
    file.bytes = 3;
    file.tag[0] = 'c';
    CHECK(job_files_read(root, job.id, &file, true, NULL) < 0);
    CHECK(job_files_put(own, "x", 1, NULL));
    job_files_tidy(own);
    CHECK(faccessat(own, JOB_FILES_TEMPORARY, F_OK, 0) && !faccessat(own, "000001.png", F_OK, 0));
    job_files_remove(root, job.id);
    CHECK(!job_files_find(own, &again));
    CHECK(!job_files_write(own, &file, "abc", 3, &error)); /* its folder is gone */
    close(own);
    close(root);
}

static void ranges(void)
{
    static const struct {
        const char *text;
        enum range range;
        uint64_t from, count;
    } rows[] = {{NULL, RANGE_ALL, 0, 0}, {"bytes=0-0", RANGE_PART, 0, 1},
        {"bytes=2-4", RANGE_PART, 2, 3}, {"bytes=5-", RANGE_PART, 5, 5},
        {"bytes=5-100", RANGE_PART, 5, 5}, {"Bytes= 9-9 ", RANGE_PART, 9, 1},
        {"bytes=-3", RANGE_PART, 7, 3}, {"bytes=-30", RANGE_PART, 0, 10},
        {"bytes=10-", RANGE_OUTSIDE, 0, 0}, {"bytes=-0", RANGE_OUTSIDE, 0, 0},
        {"bytes=4-2", RANGE_ALL, 0, 0}, {"bytes=1-2,4-5", RANGE_ALL, 0, 0},
        {"bytes=a-b", RANGE_ALL, 0, 0}, {"bytes=-", RANGE_ALL, 0, 0}, {"bytes=", RANGE_ALL, 0, 0},
        {"items=1-2", RANGE_ALL, 0, 0}, {"bytes=--3", RANGE_ALL, 0, 0},
        {"bytes=3-18446744073709551615", RANGE_PART, 3, 7},
        {"bytes=3-99999999999999999999999", RANGE_PART, 3, 7},
        {"bytes=99999999999999999999999-", RANGE_OUTSIDE, 0, 0}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        uint64_t from = 0, count = 0;
        enum range range = range_read(rows[i].text, NULL, "t", 10, &from, &count);
        CHECK(range == rows[i].range);
        CHECK(range != RANGE_PART || (from == rows[i].from && count == rows[i].count));
        if (check_failures)
            fprintf(stderr, "%s\n", rows[i].text ? rows[i].text : "none");
    }
    uint64_t from, count;
    CHECK(range_read("bytes=0-1", "\"t\"", "t", 10, &from, &count) == RANGE_PART);
    CHECK(range_read("bytes=0-1", "W/\"t\"", "t", 10, &from, &count) == RANGE_ALL);
    CHECK(range_read("bytes=0-1", "\"u\"", "t", 10, &from, &count) == RANGE_ALL);
}

int main(void)
{
    if (!mkdtemp(folder))
        return 1;
    snprintf(path, sizeof path, "%s/jobs.db", folder);
    states();
    frames_and_their_events();
    bounds();
    pages();
    keys();
    ends();
    threads();
    damage();
    files();
    ranges();
    char command[80];
    snprintf(command, sizeof command, "rm -r %s", folder);
    CHECK(system(command) == 0);
    CHECK_DONE();
}

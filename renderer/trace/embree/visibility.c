/* A job over an image of receivers: tiles, the pre-test, and when to stop. */
#include "renderer/trace/embree/kept.h"
#include "renderer/trace/embree/packet.h"
#include "renderer/trace/embree/verdicts.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TILE 16 /* receivers along an edge; a multiple of 4 */
#define TILE_RECEIVERS (TILE * TILE)

struct run {
    struct trace_pieces pieces; /* first, as trace_in_pieces wants it */
    const struct pen_trace_job *job;
    const struct pen_trace_result *result;
    struct trace_emitter emitter;
    float mean_emission[3];
    uint32_t mode; /* enum trace_mode */
    uint32_t samples;
    struct trace_points points;
    /* After the blocks before the one at hand; without counts a tile takes all its blocks at once. */
    struct pen_trace_kept kept;
    uint8_t *early; /* adaptive, in steps: of the pre-test's first points those that were seen */
    uint32_t block; /* at hand */
    uint32_t taken; /* samples before it, or of the pre-test while there are no sums */
    bool enough;    /* there are no more wanted */
    bool keeps;     /* for another job */
    uint32_t tiles_x, tile_width, tile_height;
    uint32_t tiles;
    _Atomic uint64_t rays, receivers, full_receivers;
};

struct tile {
    uint32_t x0, y0, x1, y1;
};

static struct tile tile_of(const struct run *run, uint32_t item)
{
    const struct pen_trace_job *job = run->job;
    struct tile t = {item % run->tiles_x * run->tile_width, item / run->tiles_x * run->tile_height};
    t.x1 = t.x0 + run->tile_width < job->width ? t.x0 + run->tile_width : job->width;
    t.y1 = t.y0 + run->tile_height < job->height ? t.y0 + run->tile_height : job->height;
    return t;
}

static bool read_receiver(const struct run *run, uint32_t pixel, struct trace_receiver *out)
{
    return trace_receiver_read(run->job, run->pieces.scene->extent, pixel, out);
}

/* A tile's receivers in blocks of 4 x 4 (rows when the job is a list), so that sixteen in a row are
 * close together. `full` not NULL: only those it marks. */
static uint32_t gather(const struct run *run, struct tile t, const uint8_t *full,
    struct trace_receiver receivers[TILE_RECEIVERS])
{
    uint32_t count = 0, step = run->tile_height == 1 ? 1 : 4;
    uint32_t across = run->tile_height == 1 ? run->tile_width : 4;
    for (uint32_t by = t.y0; by < t.y1; by += step)
        for (uint32_t bx = t.x0; bx < t.x1; bx += across)
            for (uint32_t y = by; y < by + step && y < t.y1; y++)
                for (uint32_t x = bx; x < bx + across && x < t.x1; x++) {
                    uint32_t pixel = y * run->job->width + x;
                    if ((!full || full[pixel]) && read_receiver(run, pixel, &receivers[count]))
                        count++;
                }
    return count;
}

static void store(const struct run *run, uint32_t pixel, const float rgb[3], float visible,
    float error, uint32_t samples)
{
    if (run->result->visibility) {
        memcpy(run->result->visibility + 4 * (size_t)pixel, rgb, 3 * sizeof *rgb);
        run->result->visibility[4 * (size_t)pixel + 3] = visible;
    }
    if (run->result->standard_error)
        run->result->standard_error[pixel] = error;
    if (run->result->samples)
        run->result->samples[pixel] = samples;
}

static void add_sums(const struct run *run, struct trace_total *t, const struct trace_sums *sums,
    int lane, uint32_t n)
{
    bool weights = run->mode & TRACE_WEIGHTS, colour = run->mode & TRACE_COLOUR;
    double visible = run->mode & (TRACE_WEIGHTS | TRACE_SHARES) ? (double)sums->visible[lane]
                                                                : sums->count[lane];
    t->samples += n;
    t->count += sums->count[lane];
    t->pairs += sums->pairs[lane];
    t->weight += weights ? sums->weight[lane] : n;
    t->visible += visible;
    for (int c = 0; c < 3; c++)
        t->rgb[c] += colour ? (double)sums->rgb[c][lane] : visible;
}

/* Standard error of the mean: see pen_trace_result. */
static float error_of(const struct trace_total *t)
{
    if (t->samples == 1 || !(t->weight > 0))
        return 0;
    return (float)(sqrt(t->pairs) / t->weight);
}

static void finish(const struct run *run, uint32_t pixel, const struct trace_total *t, bool traced)
{
    float rgb[3] = {0}, visible = 0;
    if (t->weight > 0) {
        visible = (float)(t->visible / t->weight);
        for (int c = 0; c < 3; c++)
            rgb[c] = (float)(t->rgb[c] / t->weight);
        if (t->count == t->samples) { /* nothing hidden: no noise from the emission either */
            visible = 1;
            if (!(run->mode & TRACE_WEIGHTS))
                memcpy(rgb, run->mean_emission, sizeof rgb);
        }
    }
    store(run, pixel, rgb, visible, error_of(t), traced ? t->samples : 0);
}

/* Adds one block to the totals of the listed receivers. */
static void add_block(struct run *run, uint32_t b, const struct trace_receiver *receivers,
    uint32_t count, uint32_t extra_mode, struct trace_total *totals)
{
    const struct trace_block *block = &run->points.blocks[b];
    struct trace_packet packet;
    uint64_t rays = 0;
    for (uint32_t first = 0; first < count; first += TRACE_LANES) {
        uint32_t lanes = count - first < TRACE_LANES ? count - first : TRACE_LANES;
        struct trace_sums sums = {0};
        trace_packet_load(
            &packet, &run->emitter, receivers + first, lanes, run->job->seed, run->points.low_bits);
        trace_packet_run(&run->emitter, &packet, block, run->mode | extra_mode, &sums);
        for (uint32_t lane = 0; lane < lanes; lane++)
            add_sums(run, &totals[first + lane], &sums, (int)lane, block->count);
        rays += sums.rays;
    }
    atomic_fetch_add(&run->rays, rays);
}

static bool is_done(const struct run *run, uint32_t b, const struct trace_total *t)
{
    return b + 1 == run->points.block_count ||
           (t->samples >= TRACE_STOP_AFTER && error_of(t) < run->job->target_error);
}

/* Takes all samples, or as many as the asked error needs, for the listed receivers. */
static void sample_receivers(
    struct run *run, struct trace_receiver *receivers, uint32_t count, uint32_t extra_mode)
{
    struct trace_total totals[TILE_RECEIVERS] = {0};
    for (uint32_t b = 0; b < run->points.block_count && count; b++) {
        add_block(run, b, receivers, count, extra_mode, totals);
        uint32_t kept = 0;
        for (uint32_t i = 0; i < count; i++) {
            if (is_done(run, b, &totals[i])) {
                finish(run, receivers[i].pixel, &totals[i], !(extra_mode & TRACE_ASSUME_VISIBLE));
                continue;
            }
            receivers[kept] = receivers[i];
            totals[kept++] = totals[i];
        }
        count = kept;
    }
}

/* The block at hand for those of a tile that are not done. */
static void sample_block(struct run *run, struct trace_receiver *receivers, uint32_t count)
{
    struct trace_total totals[TILE_RECEIVERS];
    uint32_t left = 0;
    for (uint32_t i = 0; i < count; i++)
        if (run->kept.counts[receivers[i].pixel].pairs != TRACE_DONE) {
            totals[left] = trace_kept_recall(&run->kept, receivers[i].pixel, run->taken);
            receivers[left++] = receivers[i];
        }
    add_block(run, run->block, receivers, left, 0, totals);
    for (uint32_t i = 0; i < left; i++) {
        uint32_t pixel = receivers[i].pixel;
        trace_kept_put(&run->kept, pixel, &totals[i]);
        if (!is_done(run, run->block, &totals[i]))
            continue;
        /* As rounded as it would be for a job that goes on from there. */
        struct trace_total t = trace_kept_recall(&run->kept, pixel, totals[i].samples);
        finish(run, pixel, &t, true);
        if (run->block + 1 < run->points.block_count)
            run->kept.counts[pixel].pairs = TRACE_DONE;
    }
}

/* Stores what the receivers that are not done have so far. */
static void estimate_tile(void *context, uint32_t item)
{
    struct run *run = context;
    struct trace_receiver receivers[TILE_RECEIVERS];
    uint32_t count = gather(run, tile_of(run, item), run->kept.full, receivers);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t pixel = receivers[i].pixel;
        struct trace_total t = {.samples = run->taken, .weight = run->taken};
        if (run->kept.counts && run->kept.counts[pixel].pairs == TRACE_DONE)
            continue;
        if (run->kept.counts) {
            t = trace_kept_recall(&run->kept, pixel, run->taken);
        } else {
            t.count = run->early[pixel];
            t.visible = t.rgb[0] = t.rgb[1] = t.rgb[2] = t.count;
            t.pairs = t.visible * (1 - t.visible / t.weight);
        }
        finish(run, pixel, &t, true);
    }
}

static void sample_tile(void *context, uint32_t item)
{
    struct run *run = context;
    struct trace_receiver receivers[TILE_RECEIVERS];
    if (trace_is_late(&run->pieces))
        return;
    uint32_t count = gather(run, tile_of(run, item), run->kept.full, receivers);
    if (run->block == 0)
        atomic_fetch_add(&run->full_receivers, count);
    if (run->kept.counts)
        sample_block(run, receivers, count);
    else
        sample_receivers(run, receivers, count, 0);
}

/* Marks what is no receiver, for good, and counts the others. */
static void clear_tile(void *context, uint32_t item)
{
    struct run *run = context;
    struct tile t = tile_of(run, item);
    uint64_t receivers = 0, full = 0;
    for (uint32_t y = t.y0; y < t.y1; y++)
        for (uint32_t x = t.x0; x < t.x1; x++) {
            struct trace_receiver receiver;
            uint32_t pixel = y * run->job->width + x;
            if (read_receiver(run, pixel, &receiver)) {
                receivers++;
                full += run->kept.samples && (!run->kept.full || run->kept.full[pixel]);
            } else {
                store(run, pixel, run->mean_emission, 1, 0, 0);
            }
        }
    atomic_fetch_add(&run->receivers, receivers);
    atomic_fetch_add(&run->full_receivers, full);
}

/* Up to a packet of the receivers from `first` on; returns how many. */
static uint32_t load_pretest(struct run *run, struct trace_packet *packet,
    const struct trace_receiver *receivers, uint32_t first, uint32_t count)
{
    uint32_t lanes = count - first < TRACE_LANES ? count - first : TRACE_LANES;
    trace_packet_load(packet, &run->emitter, receivers + first, lanes, ~run->job->seed,
        run->points.pretest_low_bits);
    return lanes;
}

/* The pre-test's first points, for a first picture. */
static void early_tile(void *context, uint32_t item)
{
    struct run *run = context;
    struct trace_receiver receivers[TILE_RECEIVERS];
    struct trace_packet packet;
    uint64_t rays = 0;
    if (trace_is_late(&run->pieces))
        return;
    uint32_t count = gather(run, tile_of(run, item), NULL, receivers);
    for (uint32_t first = 0; first < count; first += TRACE_LANES) {
        uint32_t lanes = load_pretest(run, &packet, receivers, first, count);
        struct trace_sums sums = {0};
        trace_packet_run(&run->emitter, &packet, &run->points.pretest[0], TRACE_COUNT_ONLY, &sums);
        for (uint32_t lane = 0; lane < lanes; lane++)
            run->early[receivers[first + lane].pixel] = (uint8_t)sums.count[lane];
        rays += sums.rays;
    }
    atomic_fetch_add(&run->rays, rays);
}

static void pretest_tile(void *context, uint32_t item)
{
    struct run *run = context;
    struct trace_receiver receivers[TILE_RECEIVERS];
    struct trace_packet packet;
    uint64_t rays = 0;
    if (trace_is_late(&run->pieces))
        return;
    uint32_t count = gather(run, tile_of(run, item), NULL, receivers);
    for (uint32_t first = 0; first < count; first += TRACE_LANES) {
        uint32_t lanes = load_pretest(run, &packet, receivers, first, count);
        struct trace_sums sums = {0}, rim = {0};
        uint32_t mode = run->mode & TRACE_SHARES;
        for (int k = run->early ? 1 : 0; k < 2; k++)
            trace_packet_run(&run->emitter, &packet, &run->points.pretest[k], mode, &sums);
        trace_packet_run(&run->emitter, &packet, &run->points.rim, mode | TRACE_UNSHIFTED, &rim);
        for (uint32_t lane = 0; lane < lanes; lane++) {
            uint32_t pixel = receivers[first + lane].pixel, seen = sums.count[lane];
            if (run->early)
                seen = run->early[pixel] = (uint8_t)(run->early[pixel] + seen);
            seen += rim.count[lane];
            bool dimmed = sums.visible[lane] + rim.visible[lane] > 0; /* seen through something */
            run->kept.verdicts[pixel] = seen == TRACE_PRETEST_NET + TRACE_PRETEST_RIM ? LIT
                                        : seen == 0 && !dimmed                        ? UMBRA
                                                                                      : MIXED;
        }
        rays += sums.rays + rim.rays;
    }
    atomic_fetch_add(&run->rays, rays);
}

/* Settles the receivers that need no more rays. */
static void settle_tile(void *context, uint32_t item)
{
    struct run *run = context;
    struct tile t = tile_of(run, item);
    struct trace_receiver lit[TILE_RECEIVERS];
    uint32_t lit_count = 0;
    bool exact = !((run->mode & TRACE_WEIGHTS) && (run->mode & TRACE_COLOUR));
    for (uint32_t y = t.y0; y < t.y1; y++)
        for (uint32_t x = t.x0; x < t.x1; x++) {
            static const float zero[3];
            uint32_t pixel = y * run->job->width + x, verdict = run->kept.verdicts[pixel];
            if (run->kept.full[pixel])
                continue;
            if (verdict == UMBRA)
                store(run, pixel, zero, 0, 0, 0);
            else if (verdict == LIT && exact)
                store(run, pixel, run->mean_emission, 1, 0, 0);
            else if (verdict == LIT && read_receiver(run, pixel, &lit[lit_count]))
                lit_count++;
        }
    sample_receivers(run, lit, lit_count, TRACE_ASSUME_VISIBLE);
}

static bool spread(struct run *run)
{
    const struct pen_trace_job *job = run->job;
    uint32_t radius = job->dilation ? job->dilation : TRACE_DILATION;
    return trace_verdicts_spread(
        run->kept.verdicts, job->width, job->height, radius, run->kept.full);
}

bool trace_job_check(
    const struct pen_trace_light *light, const struct pen_trace_job *job, struct pen_error *error)
{
    if (light->type > PEN_TRACE_POINT)
        return pen_fail(error, PEN_INVALID, "", "There is no light type %u.", light->type);
    bool area = light->type != PEN_TRACE_POINT;
    if ((area && !(light->half[0] > 0)) || (light->type == PEN_TRACE_RECT && !(light->half[1] > 0)))
        return pen_fail(error, PEN_INVALID, "", "The light has no extent.");
    if (light->emission && (light->columns == 0 || light->rows == 0 || light->columns > 1u << 16 ||
                               light->rows > 1u << 16))
        return pen_fail(error, PEN_INVALID, "", "The light's emission has no texels.");
    if (job->width == 0 || job->height == 0 ||
        (uint64_t)job->width * job->height >= (uint64_t)1 << 31)
        return pen_fail(error, PEN_INVALID, "", "The job has no or too many receivers.");
    if (job->samples == 0 || job->samples > TRACE_MAX_SAMPLES)
        return pen_fail(
            error, PEN_INVALID, "", "The sample count must be 1 to %u.", TRACE_MAX_SAMPLES);
    return true;
}

/* All tiles; see trace_in_pieces. */
static bool over_tiles(struct run *run, void (*work)(void *context, uint32_t item))
{
    return trace_in_pieces(&run->pieces, run->tiles, work);
}

/* All receivers have had so many samples. False when it is late. */
static bool look_up(struct run *run, uint32_t taken)
{
    const struct pen_trace_job *job = run->job;
    enum pen_trace_step step =
        job->step ? job->step(job->turn_context, taken, run->samples) : PEN_TRACE_GO_ON;
    if (step == PEN_TRACE_GO_ON)
        return true;
    run->taken = taken;
    run->enough = step == PEN_TRACE_STOP;
    if (!over_tiles(run, estimate_tile) || (!run->enough && !job->show(job->turn_context)))
        atomic_store(&run->pieces.late, true);
    run->pieces.owes = !run->enough && job->shown;
    return !atomic_load(&run->pieces.late);
}

/* The adaptive mode's first half: settles what the pre-test settles and leaves the
 * rest in `full`. */
static bool select_receivers(struct run *run, struct pen_error *error)
{
    size_t count = (size_t)run->job->width * run->job->height;
    /* What is coloured or weighted is not to be told from counts. */
    bool early = run->job->step && run->mode == TRACE_COUNT_ONLY;
    run->kept.verdicts = calloc(count, 1);
    if (early && !(run->early = calloc(count, 1)))
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    if (early &&
        (!over_tiles(run, early_tile) || !look_up(run, TRACE_PRETEST_FIRST) || run->enough))
        return true;
    run->kept.full = calloc(count, 1);
    if (!run->kept.verdicts || !run->kept.full)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    if (over_tiles(run, pretest_tile) && !spread(run))
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    if (over_tiles(run, settle_tile) && early)
        look_up(run, TRACE_PRETEST_NET);
    return true;
}

/* All samples of who needs them: block by block, or each tile at once. */
static bool sample_all(struct run *run)
{
    const struct pen_trace_job *job = run->job;
    size_t count = (size_t)job->width * job->height;
    bool in_steps = run->keeps || (job->step && run->points.block_count > 1);
    if (in_steps && !run->kept.counts)
        trace_kept_make(&run->kept, count, run->mode == TRACE_COUNT_ONLY);
    uint32_t blocks = run->kept.counts ? run->points.block_count : 1;
    run->taken = run->kept.samples;
    if (run->taken == run->samples)
        return over_tiles(run, estimate_tile);
    if (run->taken && !look_up(run, run->taken))
        return false;
    for (run->block = run->kept.blocks; run->block < blocks && !run->enough; run->block++) {
        uint32_t end = run->taken + run->points.blocks[run->block].count;
        if (!over_tiles(run, sample_tile))
            return false;
        run->kept.samples = end;
        run->kept.blocks = run->block + 1;
        if (run->block + 1 < blocks && !look_up(run, end))
            return false;
        run->taken = end;
    }
    return true;
}

static void take_over(struct run *run)
{
    struct pen_trace_kept **from = run->job->kept;
    const struct pen_trace_job *job = run->job;
    run->keeps = from && run->samples >= TRACE_FIRST_BLOCK && job->target_error == 0;
    if (!run->keeps || !*from || (*from)->samples > run->samples ||
        (*from)->receivers != (size_t)job->width * job->height)
        return;
    run->kept = **from;
    free(*from);
    *from = NULL;
}

static void leave(struct run *run)
{
    struct pen_trace_kept *to = NULL;
    if (!run->keeps || !run->kept.counts || !run->kept.samples || !(to = malloc(sizeof *to)))
        return;
    *to = run->kept;
    run->kept = (struct pen_trace_kept){0};
    pen_trace_kept_destroy(*run->job->kept);
    *run->job->kept = to;
}

bool pen_trace_visibility(struct pen_trace_scene *scene, const struct pen_trace_light *light,
    const struct pen_trace_job *job, const struct pen_trace_result *result,
    struct pen_trace_stats *stats, struct pen_error *error)
{
    double start = trace_seconds();
    struct run run = {.pieces = {.scene = scene, .job = job}, .job = job, .result = result};
    bool ok = false;
    if (!trace_job_check(light, job, error))
        return false;
    bool point = light->type == PEN_TRACE_POINT;
    run.samples = point ? 1 : trace_points_round(job->samples);
    run.emitter = trace_emitter_of(light);
    run.mode = (run.emitter.emission ? TRACE_COLOUR : 0) |
               (job->weighting == PEN_TRACE_G && !point ? TRACE_WEIGHTS : 0) |
               (scene->alpha.blends ? TRACE_SHARES : 0);
    struct trace_silhouette silhouette = {.shape = TRACE_BOTH_SIDES};
    if (job->front_only)
        silhouette = trace_silhouette_of(&run.emitter);
    uint64_t builds = scene->builds;
    const struct trace_hierarchy *hierarchy = trace_hierarchy_get(scene, &silhouette, job, error);
    if (!hierarchy)
        return false;
    double build_seconds = scene->builds != builds ? trace_seconds() - start : 0;
    start = trace_seconds();
    run.emitter.scene = hierarchy->scene;
    if (!trace_emitter_average(&run.emitter, run.mean_emission, error) ||
        !trace_points_make(
            &run.points, run.samples, run.emitter.type != PEN_TRACE_RECT, job->seed, error))
        goto fail;
    run.tile_height = job->height == 1 ? 1 : TILE;
    run.tile_width = job->height == 1 ? TILE_RECEIVERS : TILE;
    run.tiles_x = (job->width + run.tile_width - 1) / run.tile_width;
    run.tiles = run.tiles_x * ((job->height + run.tile_height - 1) / run.tile_height);
    run.pieces.threads = trace_thread_count(job->threads);
    take_over(&run);
    over_tiles(&run, clear_tile);
    if (run.kept.verdicts)
        over_tiles(&run, settle_tile);
    else if (job->adaptive && !run.kept.samples &&
             run.samples > TRACE_PRETEST_NET + TRACE_PRETEST_RIM && !select_receivers(&run, error))
        goto fail;
    if (!run.enough && !sample_all(&run)) {
        pen_fail(error, PEN_DEADLINE, "", "The deadline passed while rays were traced.");
        goto fail;
    }
    leave(&run);
    if (stats) {
        double seconds = trace_seconds() - start;
        *stats = (struct pen_trace_stats){.rays = run.rays,
            .receivers = run.receivers,
            .full_receivers = run.full_receivers,
            .build_seconds = build_seconds,
            .casters = hierarchy->triangles,
            .filtered = hierarchy->filtered,
            .seconds = seconds,
            .cpu_seconds = run.pieces.cpu_seconds,
            .mrays_per_second = (double)run.rays / seconds * 1e-6,
            .samples = run.samples,
            .threads = run.pieces.threads};
    }
    ok = true;
fail:
    trace_hierarchy_release(scene, hierarchy);
    trace_points_finish(&run.points);
    free(run.early);
    trace_kept_finish(&run.kept);
    return ok;
}

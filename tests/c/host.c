/* What a host may rely on: asynchronous renders, callbacks, snapshots, floating-point state, fork,
 * threads. Prints "ok" and a hash of one image. */
#define _DEFAULT_SOURCE
#include "caustica.h"
#include <dirent.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#define TRUE(condition)                                                                                      \
    do {                                                                                                     \
        if (!(condition)) {                                                                                  \
            caustica_detail detail_;                                                                         \
            detail_.struct_size = sizeof detail_;                                                            \
            caustica_last_error(NULL, &detail_);                                                             \
            printf("line %d: not %s (last error: %s)\n", __LINE__, #condition, detail_.text);                \
            exit(1);                                                                                         \
        }                                                                                                    \
    } while (0)
#define OK(call) TRUE((call) == CAUSTICA_OK)

/* Whether this thread flushes denormal numbers to zero, as in a host that was linked with -ffast-math. */
static bool flushes(void) {
#if defined(__x86_64__)
    return (_mm_getcsr() & 0x8040) != 0;
#else
    return false;
#endif
}

static caustica_device* device;
static caustica_scene scene;
static caustica_instance ball;
static int messages[4];
static char last_message[512];
static uint32_t last_kind;
static uint64_t last_id;

static void on_message(void* user, uint32_t severity, const caustica_detail* detail) {
    caustica_scene made;
    TRUE(user == messages);
    TRUE(severity >= CAUSTICA_SEVERITY_INFO && severity <= CAUSTICA_SEVERITY_ERROR);
    TRUE(!flushes()); /* the library computes here */
    ++messages[severity];
    memcpy(last_message, detail->text, sizeof last_message);
    last_kind = detail->object_kind;
    last_id = detail->object_id;
    /* Not callback-safe; and its error is not a message inside a message. */
    TRUE(caustica_scene_create(device, &made) == CAUSTICA_ERROR_WRONG_STATE);
}

/* Whether this thread is the only one of the process. One that was joined may be listed for a moment. */
static bool alone(void) {
    int n = 0;
    for (int attempt = 0; attempt < 1000 && n != 1; ++attempt) {
        DIR* tasks = opendir("/proc/self/task");
        TRUE(tasks != NULL);
        n = 0;
        for (struct dirent* entry = readdir(tasks); entry != NULL; entry = readdir(tasks)) n += entry->d_name[0] != '.';
        closedir(tasks);
        if (n != 1) usleep(1000);
    }
    return n == 1;
}

static caustica_material make_material(uint32_t model, float emission) {
    caustica_material_desc desc;
    caustica_material material;
    desc.struct_size = sizeof desc;
    OK(caustica_material_desc_init(&desc, model));
    for (int c = 0; c < 3; ++c) desc.emission[c] = emission;
    OK(caustica_material_create(device, &desc, &material));
    return material;
}

/* A glass ball and a lamp over a floor that curves, seen from z = 5. */
static void build(void) {
    const float sky[3] = {0.5f, 0.75f, 1};
    const double lamp_at[12] = {1, 0, 0, 2, 0, 1, 0, 2, 0, 0, 1, 2};
    const double floor_at[12] = {1, 0, 0, 0, 0, 1, 0, -51.2, 0, 0, 1, 0};
    caustica_camera_desc camera;
    caustica_material floor = make_material(CAUSTICA_MATERIAL_DIFFUSE, 0);
    caustica_material glass = make_material(CAUSTICA_MATERIAL_DIELECTRIC, 0);
    memset(&camera, 0, sizeof camera);
    camera.struct_size = sizeof camera;
    camera.projection = CAUSTICA_CAMERA_PERSPECTIVE;
    camera.name = "eye";
    camera.transform[0] = camera.transform[5] = camera.transform[10] = 1;
    camera.transform[11] = 5;
    camera.yfov = 0.8;
    OK(caustica_scene_create(device, &scene));
    OK(caustica_scene_set_environment(device, scene, sky));
    OK(caustica_scene_add_sphere(device, scene, 1, glass, NULL, "ball", &ball));
    OK(caustica_scene_add_sphere(device, scene, 0.2, make_material(CAUSTICA_MATERIAL_DIFFUSE, 9), lamp_at, "lamp", NULL));
    OK(caustica_scene_add_sphere(device, scene, 50, floor, floor_at, "floor", NULL));
    OK(caustica_scene_add_camera(device, scene, &camera, NULL));
    OK(caustica_material_release(device, floor));
    OK(caustica_material_release(device, glass)); /* the ball keeps it */
}

static caustica_render_desc request(uint32_t samples) {
    caustica_render_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.scene = scene;
    desc.width = 40;
    desc.height = 30;
    desc.samples = samples;
    desc.seed = 11;
    return desc;
}

enum { ROW = 40 * 3 + 5, ROWS = 30 };

/* FNV-1a over the pixels, read with a gap after each row that must stay as it is. */
static uint64_t hash(caustica_render_job render) {
    static float data[ROWS][ROW];
    uint64_t h = 1469598103934665603u;
    caustica_pixels pixels;
    memset(&pixels, 0, sizeof pixels);
    memset(data, 0x77, sizeof data);
    pixels.struct_size = sizeof pixels;
    pixels.format = CAUSTICA_FORMAT_RGB_F32;
    pixels.data = data;
    pixels.size = sizeof data - 5 * sizeof(float); /* the last row has no gap */
    pixels.row_stride = sizeof data[0];
    OK(caustica_render_read(device, render, &pixels));
    for (int y = 0; y < ROWS; ++y) {
        const unsigned char* bytes = (const unsigned char*)data[y];
        for (size_t i = 0; i < 40 * 3 * sizeof(float); ++i) h = (h ^ bytes[i]) * 1099511628211u;
        for (size_t i = 40 * 3 * sizeof(float); i < sizeof data[0]; ++i) TRUE(bytes[i] == 0x77);
    }
    return h;
}

static uint64_t render_hash(const caustica_render_desc* desc) {
    caustica_render_job render;
    uint64_t h;
    OK(caustica_render(device, desc, &render));
    h = hash(render);
    OK(caustica_render_release(device, render));
    return h;
}

struct observer {
    pthread_t main_thread;
    int calls;
    uint32_t stop_at; /* samples of a pixel that are enough */
    float fraction;
};

static bool on_progress(void* user, const caustica_progress* progress) {
    struct observer* observer = user;
    caustica_render_job other;
    caustica_render_desc desc = request(1);
    TRUE(progress->fraction >= observer->fraction && progress->fraction <= 1);
    TRUE(progress->state == CAUSTICA_STATE_RUNNING);
    TRUE(!flushes());
    const int errors = messages[CAUSTICA_SEVERITY_ERROR];
    TRUE(caustica_render_start(device, &desc, &other) == CAUSTICA_ERROR_WRONG_STATE);
    TRUE(messages[CAUSTICA_SEVERITY_ERROR] == errors + 1);
    caustica_detail detail = {.struct_size = sizeof detail};
    TRUE(caustica_device_release(device) == CAUSTICA_ERROR_WRONG_STATE);
    OK(caustica_last_error(device, &detail));
    TRUE(detail.code == CAUSTICA_ERROR_WRONG_STATE);
    /* What there is can be read, from the first whole pass to the end. */
    static float shown[40 * 30 * 3];
    uint32_t samples = 0;
    const caustica_pixels pixels = {.struct_size = sizeof pixels, .format = CAUSTICA_FORMAT_RGB_F32, .data = shown,
                                    .size = sizeof shown, .samples = &samples};
    const caustica_result result = caustica_render_read(device, progress->render, &pixels);
    TRUE(result == (samples > 0 ? CAUSTICA_OK : CAUSTICA_ERROR_WRONG_STATE) && samples >= progress->samples);
    observer->fraction = progress->fraction;
    ++observer->calls;
    return progress->samples < observer->stop_at;
}

static void callbacks(void) {
    struct observer observer = {pthread_self(), 0, UINT32_MAX, 0};
    caustica_render_desc desc = request(8);
    caustica_render_job render;
    caustica_statistics statistics;
    statistics.struct_size = sizeof statistics;
    desc.progress = on_progress;
    desc.user = &observer;
    OK(caustica_render(device, &desc, &render));
    TRUE(observer.calls >= 2 && observer.fraction == 1);
    OK(caustica_render_result(device, render, &statistics));
    TRUE(statistics.width == 40 && statistics.height == 30 && statistics.samples == 8);
    TRUE(statistics.camera_rays == 40 * 30 * 8 && statistics.non_finite == 0);
    TRUE(statistics.caustics <= 1 && (statistics.caustics == 1 || statistics.connection_walks == 0));
    TRUE(statistics.first_non_finite_pixel == UINT32_MAX && statistics.backend[0] != 0);
    OK(caustica_render_release(device, render));

    /* The callback ends a render that would take hours. */
    observer.fraction = 0;
    observer.calls = 0;
    observer.stop_at = 1;
    desc.samples = 100000000;
    TRUE(caustica_render(device, &desc, &render) == CAUSTICA_CANCELLED);
    TRUE(caustica_render_result(device, render, &statistics) == CAUSTICA_CANCELLED);
    TRUE(statistics.samples < desc.samples);
    hash(render);
    OK(caustica_render_release(device, render));

    /* A time limit without a number of samples takes as many as fit: of one pixel, more than the usual 64. */
    desc = request(0);
    desc.width = desc.height = 1;
    desc.time_limit_seconds = 2;
    desc.integrator = CAUSTICA_INTEGRATOR_PATH; /* no samples before the first pass */
    OK(caustica_render(device, &desc, &render));
    OK(caustica_render_result(device, render, &statistics));
    TRUE(statistics.samples > 64);
    OK(caustica_render_release(device, render));

    /* As many as a noise needs. */
    desc = request(0);
    desc.noise_limit = 0.1f;
    OK(caustica_render(device, &desc, &render));
    OK(caustica_render_result(device, render, &statistics));
    TRUE(statistics.samples >= 16 && statistics.samples < 65536 && statistics.noise > 0 && statistics.noise <= 0.1f);
    OK(caustica_render_release(device, render));
}

/* A part of the frame, and a part of the samples. */
static void parts(void) {
    caustica_render_desc desc = request(4);
    caustica_render_job render;
    caustica_statistics statistics = {.struct_size = sizeof statistics};
    static float whole[30 * 40 * 3], part[9 * 12 * 3], first[30 * 40 * 3], second[30 * 40 * 3];
    caustica_pixels pixels = {.struct_size = sizeof pixels, .format = CAUSTICA_FORMAT_RGB_F32};
    uint32_t samples = 0;
    pixels.samples = &samples;
    desc.integrator = CAUSTICA_INTEGRATOR_PATH;
#define READ(into)                                                                  \
    do {                                                                            \
        pixels.data = into;                                                         \
        pixels.size = sizeof into;                                                  \
        OK(caustica_render(device, &desc, &render));                                \
        OK(caustica_render_read(device, render, &pixels));                          \
        OK(caustica_render_result(device, render, &statistics));                    \
        OK(caustica_render_release(device, render));                                \
    } while (0)
    READ(whole);
    desc.region.x = 20;
    desc.region.y = 11;
    desc.region.width = 12;
    desc.region.height = 9;
    READ(part);
    TRUE(statistics.width == 12 && statistics.height == 9);
    for (int y = 0; y < 9; ++y) TRUE(memcmp(part + 36 * y, whole + 3 * (40 * (11 + y) + 20), 36 * sizeof(float)) == 0);
    desc.features = 1;
    pixels.image = CAUSTICA_IMAGE_ALBEDO;
    READ(part); /* the grey floor, the ball that shows it, the sky, of less light, and the lamp, of more */
    for (int i = 0; i < 9 * 12 * 3; ++i) TRUE(part[i] > 0 && part[i] <= 1);
    pixels.image = CAUSTICA_IMAGE_NORMAL;
    READ(part);
    for (int i = 0; i < 9 * 12 * 3; i += 3) TRUE(hypotf(hypotf(part[i], part[i + 1]), part[i + 2]) < 1.00001f);
    pixels.image = CAUSTICA_IMAGE_DEPTH;
    READ(part); /* the ball's front is four metres away */
    for (int i = 0; i < 9 * 12 * 3; i += 3) TRUE((part[i] == 0 || part[i] > 3.99f) && part[i] == part[i + 2]);
    TRUE(part[0] > 0);
    pixels.image = CAUSTICA_IMAGE_RADIANCE;
    READ(part);
    for (int y = 0; y < 9; ++y) TRUE(memcmp(part + 36 * y, whole + 3 * (40 * (11 + y) + 20), 36 * sizeof(float)) == 0);
    desc.features = 0;
    memset(&desc.region, 0, sizeof desc.region);
    desc.samples = 1;
    READ(first);
    desc.first_sample = 1;
    desc.samples = 3;
    READ(second);
    TRUE(samples == 3);
    for (int i = 0; i < 30 * 40 * 3; ++i) {
        const float both = (first[i] + 3 * second[i]) / 4;
        TRUE(fabsf(both - whole[i]) <= 1e-5f * both);
    }
#undef READ
}

static void asynchronous(void) {
    caustica_render_desc desc = request(100000000);
    caustica_render_job render, second;
    caustica_progress progress;
    caustica_statistics statistics = {.struct_size = sizeof statistics};
    caustica_pixels pixels;
    static float shown[40 * 30 * 3];
    const int errors = messages[CAUSTICA_SEVERITY_ERROR];
    uint32_t samples = 0;
    double sum = 0;
    size_t i;
    memset(&pixels, 0, sizeof pixels);
    pixels.struct_size = sizeof pixels;
    progress.struct_size = sizeof progress;
    OK(caustica_render_start(device, &desc, &render));
    TRUE(caustica_render_wait(device, render, 0) == CAUSTICA_TIMEOUT);
    TRUE(caustica_render_wait(device, render, 0.15) == CAUSTICA_TIMEOUT);
    OK(caustica_render_poll(device, render, &progress));
    TRUE(progress.state == CAUSTICA_STATE_RUNNING && progress.fraction < 1 && progress.render.id == render.id);
    TRUE(caustica_render_result(device, render, NULL) == CAUSTICA_ERROR_WRONG_STATE);
    TRUE(messages[CAUSTICA_SEVERITY_ERROR] == errors); /* it is only returned */
    /* Its whole passes can be read. */
    while (progress.samples == 0) {
        TRUE(caustica_render_wait(device, render, 0.01) == CAUSTICA_TIMEOUT);
        OK(caustica_render_poll(device, render, &progress));
    }
    pixels.format = CAUSTICA_FORMAT_RGB_F32;
    pixels.data = shown;
    pixels.size = sizeof shown;
    pixels.samples = &samples;
    OK(caustica_render_read(device, render, &pixels));
    for (i = 0; i < sizeof shown / sizeof *shown; ++i) sum += shown[i];
    TRUE(sum > 0 && samples >= progress.samples);
    OK(caustica_render_cancel(device, render));
    OK(caustica_render_cancel(device, render));
    OK(caustica_render_wait(device, render, -1));
    OK(caustica_render_wait(device, render, 5));
    TRUE(caustica_render_result(device, render, &statistics) == CAUSTICA_CANCELLED);
    OK(caustica_render_poll(device, render, &progress));
    TRUE(progress.state == CAUSTICA_STATE_CANCELLED);
    TRUE(progress.samples == statistics.samples && progress.elapsed_seconds == statistics.render_seconds);
    OK(caustica_render_read(device, render, &pixels));
    TRUE(samples == statistics.samples);
    OK(caustica_render_release(device, render));

    /* Released while it runs. */
    OK(caustica_render_start(device, &desc, &second));
    OK(caustica_render_release(device, second));
    TRUE(alone());
}

/* A render that fails after it was started: each call says so, and one message. */
static void failing(void) {
    caustica_render_desc desc = request(1);
    caustica_render_job render;
    caustica_progress progress = {.struct_size = sizeof progress};
    caustica_detail detail = {.struct_size = sizeof detail};
    caustica_pixels pixels = {.struct_size = sizeof pixels, .format = CAUSTICA_FORMAT_RGB_F32};
    struct rlimit before, little;
    unsigned long pages = 0;
    const int errors = messages[CAUSTICA_SEVERITY_ERROR];
    FILE* statm = fopen("/proc/self/statm", "r");
    TRUE(statm != NULL && fscanf(statm, "%lu", &pages) == 1);
    fclose(statm);
    TRUE(getrlimit(RLIMIT_AS, &before) == 0);
    little = before;
    little.rlim_cur = (rlim_t)pages * (rlim_t)sysconf(_SC_PAGESIZE) + ((rlim_t)1 << 30);
    TRUE(setrlimit(RLIMIT_AS, &little) == 0);
    desc.width = desc.height = 20000; /* several gigabytes */
    OK(caustica_render_start(device, &desc, &render));
    OK(caustica_render_wait(device, render, -1));
    TRUE(setrlimit(RLIMIT_AS, &before) == 0);
    OK(caustica_render_poll(device, render, &progress));
    TRUE(progress.state == CAUSTICA_STATE_FAILED);
    TRUE(caustica_render_result(device, render, NULL) == CAUSTICA_ERROR_OUT_OF_MEMORY);
    TRUE(caustica_render_read(device, render, &pixels) == CAUSTICA_ERROR_OUT_OF_MEMORY);
    TRUE(caustica_render_write(device, render, "failed.exr") == CAUSTICA_ERROR_OUT_OF_MEMORY);
    TRUE(messages[CAUSTICA_SEVERITY_ERROR] == errors + 1);
    TRUE(strstr(last_message, "20000x20000") != NULL);
    /* What the message callback does wrong is not what the call failed of. */
    TRUE(caustica_render_wait(device, render, 0.0 / 0.0) == CAUSTICA_ERROR_INVALID_ARGUMENT);
    TRUE(messages[CAUSTICA_SEVERITY_ERROR] == errors + 2);
    OK(caustica_last_error(device, &detail));
    TRUE(detail.code == CAUSTICA_ERROR_INVALID_ARGUMENT && strcmp(detail.parameter, "timeout_seconds") == 0);
    messages[CAUSTICA_SEVERITY_ERROR] = errors;
    OK(caustica_render_release(device, render));
}

/* What was cancelled before its first pass has no image. */
static void nothing_yet(void) {
    struct observer observer = {pthread_self(), 0, 0, 0};
    caustica_render_desc desc = request(100000000);
    caustica_render_job render;
    caustica_statistics statistics = {.struct_size = sizeof statistics};
    caustica_pixels pixels = {.struct_size = sizeof pixels, .format = CAUSTICA_FORMAT_RGB_F32};
    const int errors = messages[CAUSTICA_SEVERITY_ERROR];
    static float shown[40 * 30 * 3];
    desc.progress = on_progress;
    desc.user = &observer;
    TRUE(caustica_render(device, &desc, &render) == CAUSTICA_CANCELLED);
    TRUE(caustica_render_result(device, render, &statistics) == CAUSTICA_CANCELLED && statistics.samples == 0);
    pixels.data = shown;
    pixels.size = sizeof shown;
    TRUE(caustica_render_read(device, render, &pixels) == CAUSTICA_ERROR_WRONG_STATE);
    TRUE(caustica_render_write(device, render, "nothing.exr") == CAUSTICA_ERROR_WRONG_STATE);
    messages[CAUSTICA_SEVERITY_ERROR] = errors;
    OK(caustica_render_release(device, render));
}

/* A render keeps the snapshot it started with, and an edit shows after the next commit only. */
static void snapshots(uint64_t before) {
    const double moved[12] = {1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0};
    caustica_render_desc desc = request(4);
    caustica_render_job render;
    OK(caustica_instance_set_transform(device, ball, moved));
    TRUE(render_hash(&desc) == before);
    OK(caustica_render_start(device, &desc, &render));
    OK(caustica_scene_commit(device, scene, NULL));
    OK(caustica_render_wait(device, render, -1));
    TRUE(hash(render) == before);
    OK(caustica_render_release(device, render));
    TRUE(render_hash(&desc) != before);
    OK(caustica_instance_set_transform(device, ball, NULL));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&desc) == before);
}

/* A camera's values come back as they are, those of files, too. */
static void cameras(uint64_t before) {
    caustica_render_desc desc = request(4);
    caustica_camera camera;
    caustica_camera_desc values = {.struct_size = sizeof values, .yfov = 7};
    OK(caustica_scene_camera(device, scene, 0, &camera));
    OK(caustica_camera_get(device, camera, &values));
    TRUE(values.struct_size == sizeof values && values.projection == CAUSTICA_CAMERA_PERSPECTIVE);
    TRUE(values.yfov == 0.8 && values.transform[11] == 5 && values.transform[0] == 1 && values.name == NULL);
    OK(caustica_camera_set(device, camera, &values));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&desc) == before);
    /* It had a name, which stays. */
    values.yfov = 9;
    OK(caustica_camera_set(device, camera, &values));
    TRUE(caustica_scene_commit(device, scene, NULL) == CAUSTICA_ERROR_INVALID_ARGUMENT);
    TRUE(strstr(last_message, "'eye'") != NULL);
    values.yfov = 0.8;
    /* A lens, and a film that is moved. */
    values.lens_radius = 0.1;
    values.focus_distance = 5;
    values.shift[1] = 0.25;
    OK(caustica_camera_set(device, camera, &values));
    memset(&values, 0, sizeof values);
    values.struct_size = sizeof values;
    OK(caustica_camera_get(device, camera, &values));
    TRUE(values.lens_radius == 0.1 && values.focus_distance == 5 && values.shift[0] == 0 && values.shift[1] == 0.25);
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&desc) != before);
    values.lens_radius = values.shift[1] = 0;
    OK(caustica_camera_set(device, camera, &values));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&desc) == before);
}

/* What is built for edits shows the same. */
static void editable(uint64_t before) {
    caustica_render_desc desc = request(4);
    OK(caustica_scene_set_build(device, scene, CAUSTICA_BUILD_EDITABLE));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&desc) == before);
    OK(caustica_scene_set_build(device, scene, CAUSTICA_BUILD_STATIC));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&desc) == before);
}

/* Where nothing is before the sky, alpha says so, and the light is missing. */
static void transparent(void) {
    static float whole[30 * 40 * 4], through[30 * 40 * 4];
    caustica_render_desc desc = request(4);
    caustica_render_job render;
    caustica_pixels pixels = {.struct_size = sizeof pixels, .format = CAUSTICA_FORMAT_RGBA_F32, .size = sizeof whole};
    const float sky[3] = {0.5f, 0.75f, 1};
    int clear = 0, partly = 0;
    desc.integrator = CAUSTICA_INTEGRATOR_PATH;
    for (uint32_t i = 0; i < 2; ++i) {
        desc.transparent = i;
        pixels.data = i == 0 ? whole : through;
        OK(caustica_render(device, &desc, &render));
        OK(caustica_render_read(device, render, &pixels));
        OK(caustica_render_release(device, render));
    }
    for (int i = 0; i < 30 * 40 * 4; i += 4) {
        const float alpha = through[i + 3];
        TRUE(whole[i + 3] == 1 && alpha >= 0 && alpha <= 1);
        clear += alpha == 0;
        partly += alpha > 0 && alpha < 1;
        for (int c = 0; c < 3; ++c) {
            TRUE(fabsf(through[i + c] + (1 - alpha) * sky[c] - whole[i + c]) <= 1e-5f * whole[i + c]);
        }
    }
    TRUE(clear > 100 && clear < 1000 && partly > 10);
}

struct ended {
    int calls;
    uint64_t render;
    caustica_result result;
};

static void on_done(void* user, caustica_render_job render, caustica_result result) {
    struct ended* ended = user;
    caustica_statistics statistics = {.struct_size = sizeof statistics};
    ++ended->calls;
    ended->render = render.id;
    ended->result = result;
    TRUE(caustica_render_result(device, render, &statistics) == result && statistics.width == 40);
}

/* A view that no commit knows, and the end of a render, told to whoever does not wait. */
static void views(uint64_t before) {
    caustica_render_desc desc = request(4);
    caustica_camera_desc view = {.struct_size = sizeof view, .projection = CAUSTICA_CAMERA_PERSPECTIVE, .yfov = 0.8};
    caustica_detail detail = {.struct_size = sizeof detail};
    struct ended ended = {0, 0, 0};
    caustica_render_job render;
    view.transform[0] = view.transform[5] = view.transform[10] = 1;
    view.transform[11] = 5;
    desc.camera_desc = &view;
    desc.done = on_done;
    desc.user = &ended;
    TRUE(render_hash(&desc) == before && ended.calls == 1 && ended.result == CAUSTICA_OK);
    view.transform[3] = 0.5;
    TRUE(render_hash(&desc) != before && ended.calls == 2);
    view.yfov = 9;
    TRUE(caustica_render_start(device, &desc, &render) == CAUSTICA_ERROR_INVALID_ARGUMENT && ended.calls == 2);
    OK(caustica_last_error(device, &detail));
    TRUE(detail.object_kind == CAUSTICA_OBJECT_CAMERA && strcmp(detail.parameter, "yfov") == 0);
    desc.camera_desc = NULL;
    desc.samples = 100000000;
    OK(caustica_render_start(device, &desc, &render));
    OK(caustica_render_cancel(device, render));
    OK(caustica_render_wait(device, render, -1));
    TRUE(ended.calls == 3 && ended.render == render.id && ended.result != CAUSTICA_OK);
    OK(caustica_render_release(device, render));
}

/* What is hidden, or scaled to nothing, is as if it were not there; of the second there is a warning, once. */
static void hidden(uint64_t before) {
    const double nothing[12] = {0};
    caustica_render_desc desc = request(4);
    caustica_scene empty;
    const int warnings = messages[CAUSTICA_SEVERITY_WARNING];
    uint64_t without;
    OK(caustica_instance_set_visible(device, ball, 0));
    OK(caustica_scene_commit(device, scene, NULL));
    without = render_hash(&desc);
    TRUE(without != before && messages[CAUSTICA_SEVERITY_WARNING] == warnings);
    OK(caustica_instance_set_visible(device, ball, 1));
    OK(caustica_instance_set_transform(device, ball, nothing));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(messages[CAUSTICA_SEVERITY_WARNING] == warnings + 1 && last_kind == CAUSTICA_OBJECT_INSTANCE);
    TRUE(last_id == ball.id && strstr(last_message, "'ball'") != NULL);
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(messages[CAUSTICA_SEVERITY_WARNING] == warnings + 1 && render_hash(&desc) == without);
    OK(caustica_instance_set_transform(device, ball, NULL));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&desc) == before);

    OK(caustica_scene_create(device, &empty));
    OK(caustica_scene_commit(device, empty, NULL));
    TRUE(strstr(last_message, "no light") != NULL);
    OK(caustica_scene_release(device, empty));
}

/* A mesh that is set looks like one that was made so, after the next commit. */
static void deformed(void) {
    float corners[] = {-1, 0, 0, 1, 0, 0, 0, 1, 0};
    const uint32_t triangle[] = {0, 1, 2};
    caustica_mesh_desc desc = {.struct_size = sizeof desc, .positions = corners, .vertex_count = 3,
                               .indices = triangle, .index_count = 3};
    caustica_material lamp = make_material(CAUSTICA_MATERIAL_DIFFUSE, 1);
    caustica_camera camera;
    caustica_camera_desc view = {.struct_size = sizeof view};
    caustica_mesh mesh;
    caustica_scene scenes[2];
    uint64_t hashes[2], before = 0;
    OK(caustica_scene_camera(device, scene, 0, &camera));
    OK(caustica_camera_get(device, camera, &view));
    for (int i = 0; i < 2; ++i) {
        caustica_render_desc render = request(4);
        OK(caustica_scene_create(device, &scenes[i]));
        OK(caustica_scene_add_camera(device, scenes[i], &view, NULL));
        OK(caustica_mesh_create(device, &desc, &mesh));
        OK(caustica_scene_add_mesh(device, scenes[i], mesh, lamp, NULL, NULL, NULL));
        OK(caustica_scene_commit(device, scenes[i], NULL));
        render.scene = scenes[i];
        if (i == 0) {
            before = render_hash(&render);
            corners[7] = -1;
            OK(caustica_mesh_set(device, mesh, &desc));
            TRUE(render_hash(&render) == before);
            OK(caustica_scene_commit(device, scenes[i], NULL));
        }
        hashes[i] = render_hash(&render);
        OK(caustica_mesh_release(device, mesh));
    }
    TRUE(hashes[0] == hashes[1] && hashes[0] != before);
    for (int i = 0; i < 2; ++i) OK(caustica_scene_release(device, scenes[i]));
    OK(caustica_material_release(device, lamp));
}

/* An image of the sky: with any stride the same, kept where only its brightness or its direction is set, and gone with
 * a uniform one. */
static void surroundings(uint64_t before) {
    float pixels[2 * 4][4];
    const float sky[3] = {0.5f, 0.75f, 1};
    caustica_environment_desc desc;
    caustica_render_desc render = request(4);
    caustica_render_job job;
    uint64_t h;
    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.width = 4;
    desc.height = 2;
    desc.pixels = &pixels[0][0];
    desc.pixel_stride = sizeof pixels[0];
    for (int c = 0; c < 3; ++c) desc.radiance[c] = 1;
    for (int i = 0; i < 8; ++i) {
        for (int c = 0; c < 4; ++c) pixels[i][c] = (float)(i + c);
    }
    OK(caustica_scene_set_environment_image(device, scene, &desc));
    TRUE(render_hash(&render) == before); /* not committed */
    OK(caustica_scene_commit(device, scene, NULL));
    h = render_hash(&render);
    TRUE(h != before);

    for (int i = 0; i < 8; ++i) memmove(&pixels[0][0] + 3 * i, pixels[i], 3 * sizeof(float));
    desc.pixel_stride = 0;
    OK(caustica_scene_set_environment_image(device, scene, &desc));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&render) == h);

    desc.pixels = NULL;
    desc.width = desc.height = 0;
    OK(caustica_scene_set_environment_image(device, scene, &desc));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&render) == h);
    OK(caustica_render(device, &render, &job));
    OK(caustica_render_write(device, job, "surroundings.exr"));
    OK(caustica_render_release(device, job));
    desc.path = "surroundings.exr";
    OK(caustica_scene_set_environment_image(device, scene, &desc));
    desc.path = NULL;
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&render) != h);
    h = render_hash(&render);
    desc.transform[1] = desc.transform[4] = 1; /* x and y change places, z turns */
    desc.transform[10] = -1;
    OK(caustica_scene_set_environment_image(device, scene, &desc));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&render) != h);
    desc.transform[10] = 1; /* a mirror, which the commit refuses */
    OK(caustica_scene_set_environment_image(device, scene, &desc));
    TRUE(caustica_scene_commit(device, scene, NULL) == CAUSTICA_ERROR_INVALID_ARGUMENT);

    OK(caustica_scene_set_environment(device, scene, sky));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&render) == before);
}

/* Textures: texels with any stride, as a file, changed, transformed; kept by what has them. */
static void textures(uint64_t before) {
    static const uint8_t colors[4][4] = {{200, 10, 20, 0}, {30, 220, 40, 7}, {50, 60, 240, 9}, {255, 255, 255, 1}};
    static const uint8_t white[3] = {255, 255, 255};
    static const float positions[] = {-1, -1, 1.5f, 1, -1, 1.5f, 1, 1, 1.5f, -1, 1, 1.5f};
    static const float coordinates[] = {0, 1, 9, 1, 1, 9, 1, 0, 9, 0, 0, 9}; /* u, v and something else */
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    caustica_render_desc render = request(4);
    caustica_texture_desc desc;
    caustica_mesh_desc quad;
    caustica_material_desc material;
    caustica_texture texture;
    caustica_material painted;
    caustica_mesh mesh;
    caustica_instance shown;
    caustica_render_job job;
    uint64_t plain, h;
    int told;
    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.format = CAUSTICA_TEXELS_SRGB8;
    desc.width = desc.height = 2;
    desc.texels = colors;
    desc.texel_stride = 4;
    desc.filter = CAUSTICA_FILTER_NEAREST;
    OK(caustica_texture_create(device, &desc, &texture));
    memset(&quad, 0, sizeof quad);
    quad.struct_size = sizeof quad;
    quad.positions = positions;
    quad.vertex_count = 4;
    quad.indices = indices;
    quad.index_count = 6;
    quad.texture_coordinates = coordinates;
    quad.texture_coordinate_stride = 12;
    OK(caustica_mesh_create(device, &quad, &mesh));
    material.struct_size = sizeof material;
    OK(caustica_material_desc_init(&material, CAUSTICA_MATERIAL_DIFFUSE));
    TRUE(material.color_texture.id == 0);
    OK(caustica_material_create(device, &material, &painted));
    OK(caustica_scene_add_mesh(device, scene, mesh, painted, NULL, "painting", &shown));
    OK(caustica_scene_commit(device, scene, NULL));
    plain = render_hash(&render);
    TRUE(plain != before);

    material.color_texture = texture;
    OK(caustica_material_set(device, painted, &material));
    OK(caustica_scene_commit(device, scene, NULL));
    h = render_hash(&render);
    TRUE(h != plain);
    material.texture_transform[0] = -1; /* mirrored, to the other texels */
    material.texture_transform[4] = 1;
    OK(caustica_material_set(device, painted, &material));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&render) != h);
    memset(material.texture_transform, 0, sizeof material.texture_transform);
    OK(caustica_material_set(device, painted, &material));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&render) == h);

    /* White is what it is without a texture. The material keeps the texture. */
    desc.width = desc.height = 1;
    desc.texels = white;
    desc.texel_stride = 0;
    OK(caustica_texture_set(device, texture, &desc));
    TRUE(render_hash(&render) == h); /* not committed */
    OK(caustica_texture_release(device, texture));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&render) == plain);

    /* A file. */
    OK(caustica_render(device, &render, &job));
    OK(caustica_render_write(device, job, "painting.exr"));
    OK(caustica_render_release(device, job));
    desc.texels = NULL;
    desc.width = desc.height = 0;
    desc.path = "painting.exr";
    OK(caustica_texture_create(device, &desc, &texture));
    material.color_texture.id = 0;
    material.emission_texture = texture;
    for (int c = 0; c < 3; ++c) material.emission[c] = 2;
    OK(caustica_material_set(device, painted, &material));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&render) != plain);

    /* Without coordinates it is told, once. */
    quad.texture_coordinates = NULL;
    OK(caustica_mesh_set(device, mesh, &quad));
    told = messages[CAUSTICA_SEVERITY_WARNING];
    OK(caustica_scene_commit(device, scene, NULL));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(messages[CAUSTICA_SEVERITY_WARNING] == told + 1);
    TRUE(strstr(last_message, "has no texture coordinates") != NULL);

    OK(caustica_texture_release(device, texture));
    OK(caustica_instance_remove(device, shown));
    OK(caustica_material_release(device, painted));
    OK(caustica_mesh_release(device, mesh));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(render_hash(&render) == before);
}

/* What renders cannot find is told at the commit. */
static void limits(void) {
    caustica_light_desc desc;
    caustica_light light;
    int told;
    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.kind = CAUSTICA_LIGHT_POINT;
    desc.position[1] = 3;
    desc.intensity[0] = 1;
    TRUE(messages[CAUSTICA_SEVERITY_INFO] == 0);
    OK(caustica_scene_add_light(device, scene, &desc, &light));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(messages[CAUSTICA_SEVERITY_INFO] > 0 && strstr(last_message, "delta lights") != NULL);
    told = messages[CAUSTICA_SEVERITY_INFO];
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(messages[CAUSTICA_SEVERITY_INFO] == told); /* once */
    messages[CAUSTICA_SEVERITY_INFO] = 0;
    OK(caustica_light_remove(device, light));
    OK(caustica_scene_commit(device, scene, NULL));
    TRUE(messages[CAUSTICA_SEVERITY_INFO] == 0);
}

/* Options of connections: zero is the default, and each of them says something. */
static void options(uint64_t before) {
    caustica_caustic_options o;
    uint64_t connected;
    caustica_render_desc desc = request(4);
    memset(&o, 0, sizeof o);
    o.struct_size = sizeof o;
    desc.caustic_options = &o;
    TRUE(render_hash(&desc) == before);
    o.roulette_threshold = 0.5f;
    o.walk_tolerance = 1e-8;
    TRUE(render_hash(&desc) == before);
    desc.integrator = CAUSTICA_INTEGRATOR_BDPT;
    connected = render_hash(&desc);
    o.roulette = CAUSTICA_ROULETTE_OFF;
    TRUE(render_hash(&desc) != connected);
    o.geometry_term = CAUSTICA_GEOMETRY_TERM_DIRECT;
    o.check = CAUSTICA_CHECK_FEW;
    o.roulette = CAUSTICA_ROULETTE_LENGTHS;
    o.seeds = 1;
    o.search = o.aim = -1;
    o.light_subpaths = 1;
    o.walk_iterations = 3;
    TRUE(render_hash(&desc) != connected);
    desc.caustic_options = NULL;
    TRUE(render_hash(&desc) == connected);
    desc.caustics_only = 1;
    TRUE(render_hash(&desc) != before);
}

static void forked(void) {
    caustica_render_desc desc = request(1);
    int status = 0;
    pid_t child = fork();
    if (child == 0) {
        caustica_render_job render;
        caustica_detail detail;
        detail.struct_size = sizeof detail;
        if (caustica_render(device, &desc, &render) != CAUSTICA_ERROR_INVALID_HANDLE) _exit(1);
        if (caustica_device_release(device) != CAUSTICA_ERROR_INVALID_HANDLE) _exit(2);
        if (caustica_last_error(NULL, &detail) != CAUSTICA_OK) _exit(3);
        _exit(strstr(detail.text, "fork") == NULL ? 4 : 0);
    }
    TRUE(child > 0 && waitpid(child, &status, 0) == child);
    TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

static caustica_device* create(uint32_t threads) {
    caustica_device_options options;
    caustica_device* made;
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    options.version = CAUSTICA_VERSION;
    options.num_threads = threads;
    options.message = on_message;
    options.user = messages;
    OK(caustica_device_create(&options, &made));
    return made;
}

/* Many threads on one device: their own objects, and a scene of all of them. */
static void* many(void* user) {
    (void)user;
    for (int i = 0; i < 200; ++i) {
        const float sky[3] = {0.5f, 0.75f, 1};
        caustica_scene own;
        OK(caustica_scene_create(device, &own));
        OK(caustica_scene_set_environment(device, own, sky));
        OK(caustica_scene_set_environment(device, scene, sky));
        OK(caustica_scene_release(device, own));
    }
    return NULL;
}

static void concurrent(void) {
    pthread_t threads[4];
    for (int i = 0; i < 4; ++i) TRUE(pthread_create(&threads[i], NULL, many, NULL) == 0);
    for (int i = 0; i < 4; ++i) pthread_join(threads[i], NULL);
}

int main(void) {
    caustica_render_desc desc = request(4);
    caustica_render_job render;
    caustica_commit_report report;
    uint64_t h;
    const bool flushing = flushes();
#if defined(__x86_64__) && defined(__FAST_MATH__)
    TRUE(flushing);
#endif
    report.struct_size = sizeof report;
    device = create(1);
    build();
    OK(caustica_scene_commit(device, scene, &report));
    TRUE(report.triangle_count == 0 && report.scene_hash != 0);
    TRUE(report.center[1] < -40 && report.radius > 50 && report.radius < 100);
    desc.scene = scene;
    h = render_hash(&desc);
    desc.num_threads = 2;
    TRUE(render_hash(&desc) == h);
    desc.seed = 12;
    TRUE(render_hash(&desc) != h);

    callbacks();
    parts();
    asynchronous();
    failing();
    nothing_yet();
    options(h);
    snapshots(h);
    cameras(h);
    editable(h);
    hidden(h);
    transparent();
    views(h);
    deformed();
    surroundings(h);
    textures(h);
    limits();
    forked();
    concurrent();

    /* An error is a message too. */
    TRUE(caustica_scene_create(device, NULL) == CAUSTICA_ERROR_INVALID_ARGUMENT);
    TRUE(messages[CAUSTICA_SEVERITY_ERROR] > 0 && strstr(last_message, "scene") != NULL);

    /* A device ends its renders. What was left alive is told. */
    desc = request(100000000);
    OK(caustica_render_start(device, &desc, &render));
    OK(caustica_device_release(device));
    TRUE(messages[CAUSTICA_SEVERITY_INFO] == 1 && strstr(last_message, "1 render") != NULL);
    TRUE(caustica_render_release(device, render) == CAUSTICA_ERROR_INVALID_HANDLE);
    TRUE(alone());

    for (int i = 0; i < 3; ++i) {
        device = create(2);
        OK(caustica_device_release(device));
    }
    TRUE(alone());
    TRUE(flushes() == flushing);
    printf("ok %016llx\n", (unsigned long long)h);
    return 0;
}

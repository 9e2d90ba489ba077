/* Wrong calls of every function: each gives its code, and none crashes or prints. */
#include "caustica.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

#define EXPECT(code, call)                                                                                   \
    do {                                                                                                     \
        caustica_result got_ = (call);                                                                       \
        if (got_ != (code)) {                                                                                \
            printf("line %d: %s gave %d, not %d\n", __LINE__, #call, (int)got_, (int)(code));                \
            ++failures;                                                                                      \
        }                                                                                                    \
    } while (0)
#define TRUE(condition)                                                                                      \
    do {                                                                                                     \
        if (!(condition)) {                                                                                  \
            printf("line %d: not %s\n", __LINE__, #condition);                                               \
            ++failures;                                                                                      \
        }                                                                                                    \
    } while (0)

/* `call` with every wrong device `d`. */
#define DEVICES(call)                                                                                        \
    do {                                                                                                     \
        for (size_t i_ = 0; i_ < sizeof wrong_devices / sizeof wrong_devices[0]; ++i_) {                     \
            caustica_device* d = wrong_devices[i_];                                                          \
            EXPECT(CAUSTICA_ERROR_INVALID_HANDLE, call);                                                     \
        }                                                                                                    \
    } while (0)
/* `call` with every wrong handle `h` of a type. */
#define HANDLES(type, kind, call)                                                                            \
    do {                                                                                                     \
        for (size_t i_ = 0; i_ < 10; ++i_) {                                                                 \
            caustica_##type h = {wrong_id(i_, kind)};                                                        \
            EXPECT(CAUSTICA_ERROR_INVALID_HANDLE, call);                                                     \
        }                                                                                                    \
    } while (0)
/* `call` with every wrong size of a descriptor. */
#define SIZES(desc, call)                                                                                    \
    do {                                                                                                     \
        uint32_t size_ = (desc).struct_size;                                                                 \
        const uint32_t wrong_[] = {0, 3, size_ - 1, 4097, UINT32_MAX};                                       \
        for (size_t i_ = 0; i_ < 5; ++i_) {                                                                  \
            (desc).struct_size = wrong_[i_];                                                                 \
            EXPECT(CAUSTICA_ERROR_INCOMPATIBLE_VERSION, call);                                               \
        }                                                                                                    \
        (desc).struct_size = size_;                                                                          \
    } while (0)
/* `call` with a field set to a value, which is then taken back. */
#define WITH(field, value, code, call)                                                                       \
    do {                                                                                                     \
        __typeof__(field) kept_ = (field);                                                                   \
        (field) = (value);                                                                                   \
        EXPECT(code, call);                                                                                  \
        (field) = kept_;                                                                                     \
    } while (0)

#define INVALID CAUSTICA_ERROR_INVALID_ARGUMENT

static caustica_device* device;
static caustica_device* wrong_devices[5];

/* Living, released and foreign handles by kind of object. */
static uint64_t living[10], stale[10], foreign[10];

static uint64_t wrong_id(size_t i, int kind) {
    switch (i) {
    case 0: return 0;
    case 1: return UINT64_MAX;
    case 2: return 1;
    case 3: return stale[kind];
    case 4: return foreign[kind];
    case 5: return living[kind] + 1;          /* another slot */
    case 6: return living[kind] ^ 1ull << 24; /* another generation */
    case 7: return living[kind] ^ 1ull << 63; /* another device */
    default: return living[1 + (kind + (int)i - 8) % 9]; /* two other kinds */
    }
}

static const float corners[] = {-1, 0, -1, -1, 0, 1, 1, 0, 1};
static const uint32_t triangle[] = {0, 1, 2};

static caustica_mesh_desc mesh_desc(void) {
    caustica_mesh_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.positions = corners;
    desc.vertex_count = 3;
    desc.indices = triangle;
    desc.index_count = 3;
    desc.name = "triangle";
    return desc;
}

static const uint8_t texel[] = {10, 20, 30};

static caustica_texture_desc texture_desc(void) {
    caustica_texture_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.format = CAUSTICA_TEXELS_SRGB8;
    desc.name = "texel";
    desc.width = desc.height = 1;
    desc.texels = texel;
    return desc;
}

static caustica_material_desc material_desc(void) {
    caustica_material_desc desc;
    desc.struct_size = sizeof desc;
    EXPECT(CAUSTICA_OK, caustica_material_desc_init(&desc, CAUSTICA_MATERIAL_DIFFUSE));
    return desc;
}

static caustica_light_desc light_desc(void) {
    caustica_light_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.kind = CAUSTICA_LIGHT_POINT;
    desc.position[1] = 2;
    desc.intensity[0] = desc.intensity[1] = desc.intensity[2] = 1;
    return desc;
}

static caustica_camera_desc camera_desc(void) {
    caustica_camera_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.projection = CAUSTICA_CAMERA_PERSPECTIVE;
    desc.yfov = 1;
    return desc;
}

/* One object of each kind; `ids` by kind. */
static void make_all(caustica_device* d, uint64_t ids[10]) {
    caustica_texture_desc td = texture_desc();
    caustica_mesh_desc md = mesh_desc();
    caustica_material_desc matd = material_desc();
    caustica_light_desc ld = light_desc();
    caustica_camera_desc cd = camera_desc();
    caustica_texture texture;
    caustica_mesh mesh;
    caustica_material material;
    caustica_instance instance;
    caustica_light light;
    caustica_camera camera;
    caustica_render_job render;
    caustica_render_desc rd;
    memset(&rd, 0, sizeof rd);
    rd.struct_size = sizeof rd;
    rd.width = rd.height = rd.samples = 2;
    EXPECT(CAUSTICA_OK, caustica_texture_create(d, &td, &texture));
    EXPECT(CAUSTICA_OK, caustica_mesh_create(d, &md, &mesh));
    EXPECT(CAUSTICA_OK, caustica_material_create(d, &matd, &material));
    EXPECT(CAUSTICA_OK, caustica_scene_create(d, &rd.scene));
    EXPECT(CAUSTICA_OK, caustica_scene_add_mesh(d, rd.scene, mesh, material, NULL, "it", &instance));
    EXPECT(CAUSTICA_OK, caustica_scene_add_light(d, rd.scene, &ld, &light));
    EXPECT(CAUSTICA_OK, caustica_scene_add_camera(d, rd.scene, &cd, &camera));
    EXPECT(CAUSTICA_OK, caustica_scene_commit(d, rd.scene, NULL));
    EXPECT(CAUSTICA_OK, caustica_render(d, &rd, &render));
    ids[0] = 0;
    ids[CAUSTICA_OBJECT_DEVICE] = 1;
    ids[CAUSTICA_OBJECT_MESH] = mesh.id;
    ids[CAUSTICA_OBJECT_MATERIAL] = material.id;
    ids[CAUSTICA_OBJECT_SCENE] = rd.scene.id;
    ids[CAUSTICA_OBJECT_INSTANCE] = instance.id;
    ids[CAUSTICA_OBJECT_LIGHT] = light.id;
    ids[CAUSTICA_OBJECT_CAMERA] = camera.id;
    ids[CAUSTICA_OBJECT_RENDER] = render.id;
    ids[CAUSTICA_OBJECT_TEXTURE] = texture.id;
}

static void release_all(caustica_device* d, const uint64_t ids[10]) {
    const caustica_instance instance = {ids[CAUSTICA_OBJECT_INSTANCE]};
    const caustica_light light = {ids[CAUSTICA_OBJECT_LIGHT]};
    const caustica_camera camera = {ids[CAUSTICA_OBJECT_CAMERA]};
    const caustica_scene scene = {ids[CAUSTICA_OBJECT_SCENE]};
    const caustica_texture texture = {ids[CAUSTICA_OBJECT_TEXTURE]};
    const caustica_mesh mesh = {ids[CAUSTICA_OBJECT_MESH]};
    const caustica_material material = {ids[CAUSTICA_OBJECT_MATERIAL]};
    const caustica_render_job render = {ids[CAUSTICA_OBJECT_RENDER]};
    for (int again = 0; again < 2; ++again) {
        caustica_result code = again ? CAUSTICA_ERROR_INVALID_HANDLE : CAUSTICA_OK;
        EXPECT(code, caustica_render_release(d, render));
        EXPECT(code, caustica_instance_remove(d, instance));
        EXPECT(code, caustica_light_remove(d, light));
        EXPECT(code, caustica_camera_remove(d, camera));
        EXPECT(code, caustica_scene_release(d, scene));
        EXPECT(code, caustica_mesh_release(d, mesh));
        EXPECT(code, caustica_material_release(d, material));
        EXPECT(code, caustica_texture_release(d, texture));
    }
}

static void device_calls(void) {
    caustica_device_options options;
    caustica_device* made = NULL;
    caustica_detail detail;
    uint64_t length = 0;
    char text[8];
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    options.version = CAUSTICA_VERSION;
    detail.struct_size = sizeof detail;

    EXPECT(INVALID, caustica_device_create(NULL, &made));
    EXPECT(INVALID, caustica_device_create(&options, NULL));
    SIZES(options, caustica_device_create(&options, &made));
    EXPECT(INVALID, caustica_device_create(NULL, &made));
    EXPECT(CAUSTICA_OK, caustica_last_error(NULL, &detail));
    TRUE(detail.code == INVALID && strcmp(detail.parameter, "options") == 0);
    WITH(options.version, 0, CAUSTICA_ERROR_INCOMPATIBLE_VERSION, caustica_device_create(&options, &made));
    WITH(options.version, 1u << 22, CAUSTICA_ERROR_INCOMPATIBLE_VERSION, caustica_device_create(&options, &made));
    WITH(options.version, 1, CAUSTICA_ERROR_INCOMPATIBLE_VERSION, caustica_device_create(&options, &made)); /* 0.0.1 */
    WITH(options.version, CAUSTICA_VERSION + (1u << 12), CAUSTICA_ERROR_INCOMPATIBLE_VERSION,
         caustica_device_create(&options, &made));
    WITH(options.backend, 3, INVALID, caustica_device_create(&options, &made));
    WITH(options.num_threads, UINT32_MAX, CAUSTICA_ERROR_LIMIT, caustica_device_create(&options, &made));
    TRUE(made == NULL);
    DEVICES(caustica_device_release(d));

    EXPECT(INVALID, caustica_last_error(NULL, NULL));
    SIZES(detail, caustica_last_error(NULL, &detail));
    EXPECT(CAUSTICA_OK, caustica_last_error(wrong_devices[2], &detail));

    EXPECT(CAUSTICA_OK, caustica_build_info(NULL, 0, NULL));
    EXPECT(CAUSTICA_OK, caustica_build_info(NULL, UINT64_MAX, &length));
    EXPECT(CAUSTICA_OK, caustica_build_info(text, sizeof text, &length));
    TRUE(strcmp(text, "caustic") == 0 && length > 7);
    TRUE(caustica_version() == CAUSTICA_VERSION);
    TRUE(strcmp(caustica_result_text(12345), "unknown result") == 0);
}

/* A descriptor of a later version: known fields, then others. */
struct later {
    caustica_mesh_desc known;
    uint64_t unknown;
};

static void mesh_calls(void) {
    caustica_mesh_desc desc = mesh_desc();
    caustica_mesh mesh = {0};
    struct later later = {mesh_desc(), 0};
    char name[2000];

    DEVICES(caustica_mesh_create(d, &desc, &mesh));
    EXPECT(INVALID, caustica_mesh_create(device, NULL, &mesh));
    EXPECT(INVALID, caustica_mesh_create(device, &desc, NULL));
    SIZES(desc, caustica_mesh_create(device, &desc, &mesh));
    WITH(desc.reserved, 1, INVALID, caustica_mesh_create(device, &desc, &mesh));
    WITH(desc.positions, NULL, INVALID, caustica_mesh_create(device, &desc, &mesh));
    WITH(desc.indices, NULL, INVALID, caustica_mesh_create(device, &desc, &mesh));
    WITH(desc.vertex_count, UINT64_MAX, CAUSTICA_ERROR_LIMIT, caustica_mesh_create(device, &desc, &mesh));
    WITH(desc.position_stride, 11, INVALID, caustica_mesh_create(device, &desc, &mesh));
    WITH(desc.position_stride, UINT64_MAX, CAUSTICA_ERROR_LIMIT, caustica_mesh_create(device, &desc, &mesh));
    WITH(desc.index_count, 4, INVALID, caustica_mesh_create(device, &desc, &mesh));
    WITH(desc.index_count, UINT64_MAX, CAUSTICA_ERROR_LIMIT, caustica_mesh_create(device, &desc, &mesh));
    /* Fits into the address space, and into no memory. */
    WITH(desc.index_count, 3ull << 58, CAUSTICA_ERROR_OUT_OF_MEMORY, caustica_mesh_create(device, &desc, &mesh));
    desc.normals = corners;
    WITH(desc.normal_stride, 4, INVALID, caustica_mesh_create(device, &desc, &mesh));
    desc.normals = NULL;
    desc.texture_coordinates = corners;
    WITH(desc.texture_coordinate_stride, 7, INVALID, caustica_mesh_create(device, &desc, &mesh));
    WITH(desc.texture_coordinate_stride, UINT64_MAX, CAUSTICA_ERROR_LIMIT, caustica_mesh_create(device, &desc, &mesh));
    desc.texture_coordinates = NULL;
    WITH(desc.name, "\xff", INVALID, caustica_mesh_create(device, &desc, &mesh));
    memset(name, 'n', sizeof name);
    name[sizeof name - 1] = 0;
    WITH(desc.name, name, CAUSTICA_ERROR_LIMIT, caustica_mesh_create(device, &desc, &mesh));
    TRUE(mesh.id == 0);

    later.known.struct_size = sizeof later;
    later.unknown = 5;
    EXPECT(CAUSTICA_ERROR_INCOMPATIBLE_VERSION, caustica_mesh_create(device, &later.known, &mesh));
    later.unknown = 0;
    EXPECT(CAUSTICA_OK, caustica_mesh_create(device, &later.known, &mesh));
    DEVICES(caustica_mesh_set(d, mesh, &desc));
    HANDLES(mesh, CAUSTICA_OBJECT_MESH, caustica_mesh_set(device, h, &desc));
    EXPECT(INVALID, caustica_mesh_set(device, mesh, NULL));
    SIZES(desc, caustica_mesh_set(device, mesh, &desc));
    WITH(desc.index_count, 4, INVALID, caustica_mesh_set(device, mesh, &desc));
    /* What a vector kept that was emptied. */
    WITH(desc.index_count, 0, CAUSTICA_OK, caustica_mesh_set(device, mesh, &desc));
    EXPECT(CAUSTICA_OK, caustica_mesh_release(device, mesh));
    DEVICES(caustica_mesh_release(d, mesh));
    HANDLES(mesh, CAUSTICA_OBJECT_MESH, caustica_mesh_release(device, h));
}

static void texture_calls(void) {
    caustica_texture_desc desc = texture_desc();
    caustica_texture texture = {0};
    const caustica_texture own = {living[CAUSTICA_OBJECT_TEXTURE]};
    const float floats[3] = {1, NAN, 1}, negative[3] = {1, 1, -1};
    caustica_detail detail;
    detail.struct_size = sizeof detail;

    DEVICES(caustica_texture_create(d, &desc, &texture));
    EXPECT(INVALID, caustica_texture_create(device, NULL, &texture));
    EXPECT(INVALID, caustica_texture_create(device, &desc, NULL));
    SIZES(desc, caustica_texture_create(device, &desc, &texture));
    WITH(desc.reserved, 1, INVALID, caustica_texture_create(device, &desc, &texture));
    WITH(desc.format, 0, INVALID, caustica_texture_create(device, &desc, &texture));
    WITH(desc.format, 4, INVALID, caustica_texture_create(device, &desc, &texture));
    WITH(desc.width, 0, INVALID, caustica_texture_create(device, &desc, &texture));
    WITH(desc.height, 65537, INVALID, caustica_texture_create(device, &desc, &texture));
    WITH(desc.texels, NULL, INVALID, caustica_texture_create(device, &desc, &texture));
    WITH(desc.texel_stride, 2, INVALID, caustica_texture_create(device, &desc, &texture));
    WITH(desc.texel_stride, UINT64_MAX, CAUSTICA_ERROR_LIMIT, caustica_texture_create(device, &desc, &texture));
    WITH(desc.wrap_u, 3, INVALID, caustica_texture_create(device, &desc, &texture));
    WITH(desc.wrap_v, UINT32_MAX, INVALID, caustica_texture_create(device, &desc, &texture));
    WITH(desc.filter, 2, INVALID, caustica_texture_create(device, &desc, &texture));
    WITH(desc.path, "beside.exr", INVALID, caustica_texture_create(device, &desc, &texture));
    desc.format = CAUSTICA_TEXELS_FLOAT;
    WITH(desc.texels, negative, INVALID, caustica_texture_create(device, &desc, &texture));
    WITH(desc.texels, floats, INVALID, caustica_texture_create(device, &desc, &texture));
    EXPECT(CAUSTICA_OK, caustica_last_error(device, &detail));
    TRUE(strcmp(detail.parameter, "texels") == 0 && detail.index == 0 && strcmp(detail.object_name, "texel") == 0);
    desc.texels = NULL;
    WITH(desc.path, "\xc3", INVALID, caustica_texture_create(device, &desc, &texture));
    WITH(desc.path, "no such file.exr", CAUSTICA_ERROR_IO, caustica_texture_create(device, &desc, &texture));
    WITH(desc.path, "texture.xyz", CAUSTICA_ERROR_UNSUPPORTED, caustica_texture_create(device, &desc, &texture));
    TRUE(texture.id == 0);

    desc = texture_desc();
    DEVICES(caustica_texture_set(d, own, &desc));
    HANDLES(texture, CAUSTICA_OBJECT_TEXTURE, caustica_texture_set(device, h, &desc));
    EXPECT(INVALID, caustica_texture_set(device, own, NULL));
    SIZES(desc, caustica_texture_set(device, own, &desc));
    WITH(desc.width, 0, INVALID, caustica_texture_set(device, own, &desc));
    DEVICES(caustica_texture_release(d, own));
    HANDLES(texture, CAUSTICA_OBJECT_TEXTURE, caustica_texture_release(device, h));
}

static void material_calls(void) {
    caustica_material_desc desc = material_desc();
    caustica_material material = {0};
    const caustica_material own = {living[CAUSTICA_OBJECT_MATERIAL]};

    EXPECT(INVALID, caustica_material_desc_init(NULL, CAUSTICA_MATERIAL_DIFFUSE));
    EXPECT(INVALID, caustica_material_desc_init(&desc, 0));
    EXPECT(INVALID, caustica_material_desc_init(&desc, 6));
    SIZES(desc, caustica_material_desc_init(&desc, CAUSTICA_MATERIAL_DIFFUSE));
    DEVICES(caustica_material_create(d, &desc, &material));
    DEVICES(caustica_material_set(d, own, &desc));
    DEVICES(caustica_material_release(d, own));
    HANDLES(material, CAUSTICA_OBJECT_MATERIAL, caustica_material_set(device, h, &desc));
    HANDLES(material, CAUSTICA_OBJECT_MATERIAL, caustica_material_release(device, h));
    EXPECT(INVALID, caustica_material_create(device, NULL, &material));
    EXPECT(INVALID, caustica_material_create(device, &desc, NULL));
    EXPECT(INVALID, caustica_material_set(device, own, NULL));
    SIZES(desc, caustica_material_create(device, &desc, &material));
    WITH(desc.model, 0, INVALID, caustica_material_create(device, &desc, &material));
    WITH(desc.model, 6, INVALID, caustica_material_set(device, own, &desc));
    WITH(desc.solid, 2, INVALID, caustica_material_create(device, &desc, &material));
    WITH(desc.emission_two_sided, UINT32_MAX, INVALID, caustica_material_create(device, &desc, &material));
    WITH(desc.reserved, 1, INVALID, caustica_material_create(device, &desc, &material));
    WITH(desc.normal_scale, NAN, INVALID, caustica_material_create(device, &desc, &material));
    WITH(desc.normal_texture.id, UINT64_MAX, CAUSTICA_ERROR_INVALID_HANDLE,
         caustica_material_create(device, &desc, &material));
    WITH(desc.texture_transform[4], INFINITY, INVALID, caustica_material_create(device, &desc, &material));
    WITH(desc.color_texture.id, stale[CAUSTICA_OBJECT_TEXTURE], CAUSTICA_ERROR_INVALID_HANDLE,
         caustica_material_create(device, &desc, &material));
    WITH(desc.metallic_roughness_texture.id, foreign[CAUSTICA_OBJECT_TEXTURE], CAUSTICA_ERROR_INVALID_HANDLE,
         caustica_material_create(device, &desc, &material));
    WITH(desc.emission_texture.id, living[CAUSTICA_OBJECT_MESH], CAUSTICA_ERROR_INVALID_HANDLE,
         caustica_material_set(device, own, &desc));
    TRUE(material.id == 0);
}

static void scene_calls(void) {
    const caustica_scene scene = {living[CAUSTICA_OBJECT_SCENE]};
    const caustica_mesh mesh = {living[CAUSTICA_OBJECT_MESH]};
    const caustica_material material = {living[CAUSTICA_OBJECT_MATERIAL]};
    const caustica_instance instance = {living[CAUSTICA_OBJECT_INSTANCE]};
    const float dark[3] = {0, 0, 0}, negative[3] = {0, -1, 0}, infinite[3] = {0, 0, INFINITY};
    double m[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const float pixels[6] = {1, 1, 1, 1, NAN, 1};
    caustica_environment_desc sky;
    caustica_commit_report report;
    caustica_scene made = {0};
    caustica_instance none = {0};
    uint32_t warnings = 77;
    report.struct_size = sizeof report;

    DEVICES(caustica_scene_create(d, &made));
    EXPECT(INVALID, caustica_scene_create(device, NULL));
    DEVICES(caustica_scene_release(d, scene));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, caustica_scene_release(device, h));
    DEVICES(caustica_scene_commit(d, scene, NULL));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, caustica_scene_commit(device, h, NULL));
    SIZES(report, caustica_scene_commit(device, scene, &report));
    DEVICES(caustica_scene_set_build(d, scene, CAUSTICA_BUILD_EDITABLE));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, caustica_scene_set_build(device, h, CAUSTICA_BUILD_EDITABLE));
    EXPECT(INVALID, caustica_scene_set_build(device, scene, 0));
    EXPECT(INVALID, caustica_scene_set_build(device, scene, 3));
    DEVICES(caustica_scene_set_environment(d, scene, dark));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, caustica_scene_set_environment(device, h, dark));
    EXPECT(INVALID, caustica_scene_set_environment(device, scene, NULL));
    EXPECT(INVALID, caustica_scene_set_environment(device, scene, negative));
    EXPECT(INVALID, caustica_scene_set_environment(device, scene, infinite));

    memset(&sky, 0, sizeof sky);
    sky.struct_size = sizeof sky;
    sky.pixels = pixels;
    sky.width = sky.height = 1;
    DEVICES(caustica_scene_set_environment_image(d, scene, &sky));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, caustica_scene_set_environment_image(device, h, &sky));
    EXPECT(INVALID, caustica_scene_set_environment_image(device, scene, NULL));
    SIZES(sky, caustica_scene_set_environment_image(device, scene, &sky));
    WITH(sky.radiance[1], -1, INVALID, caustica_scene_set_environment_image(device, scene, &sky));
    WITH(sky.width, 0, INVALID, caustica_scene_set_environment_image(device, scene, &sky));
    WITH(sky.height, 2, INVALID, caustica_scene_set_environment_image(device, scene, &sky));
    WITH(sky.width, 2, INVALID, caustica_scene_set_environment_image(device, scene, &sky));
    WITH(sky.pixel_stride, 11, INVALID, caustica_scene_set_environment_image(device, scene, &sky));
    WITH(sky.transform[0], NAN, INVALID, caustica_scene_set_environment_image(device, scene, &sky));
    WITH(sky.path, "sky.exr", INVALID, caustica_scene_set_environment_image(device, scene, &sky));
    sky.pixels = NULL;
    EXPECT(INVALID, caustica_scene_set_environment_image(device, scene, &sky));
    sky.width = sky.height = 0;
    EXPECT(CAUSTICA_ERROR_WRONG_STATE, caustica_scene_set_environment_image(device, scene, &sky));
    WITH(sky.path, "\xc3", INVALID, caustica_scene_set_environment_image(device, scene, &sky));
    WITH(sky.path, "no such file.exr", CAUSTICA_ERROR_IO, caustica_scene_set_environment_image(device, scene, &sky));
    WITH(sky.path, "sky.xyz", CAUSTICA_ERROR_UNSUPPORTED, caustica_scene_set_environment_image(device, scene, &sky));

    DEVICES(caustica_scene_load(d, scene, "x.glb", &warnings));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, caustica_scene_load(device, h, "x.glb", &warnings));
    EXPECT(INVALID, caustica_scene_load(device, scene, NULL, &warnings));
    EXPECT(INVALID, caustica_scene_load(device, scene, "\xc3", &warnings));
    EXPECT(CAUSTICA_ERROR_IO, caustica_scene_load(device, scene, "no such file.glb", &warnings));
    TRUE(warnings == 77);

    DEVICES(caustica_scene_add_mesh(d, scene, mesh, material, m, NULL, &none));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, caustica_scene_add_mesh(device, h, mesh, material, m, NULL, &none));
    HANDLES(mesh, CAUSTICA_OBJECT_MESH, caustica_scene_add_mesh(device, scene, h, material, m, NULL, &none));
    HANDLES(material, CAUSTICA_OBJECT_MATERIAL, caustica_scene_add_mesh(device, scene, mesh, h, m, NULL, &none));
    DEVICES(caustica_scene_add_sphere(d, scene, 1, material, m, NULL, &none));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, caustica_scene_add_sphere(device, h, 1, material, m, NULL, &none));
    HANDLES(material, CAUSTICA_OBJECT_MATERIAL, caustica_scene_add_sphere(device, scene, 1, h, m, NULL, &none));
    EXPECT(INVALID, caustica_scene_add_sphere(device, scene, NAN, material, m, NULL, &none));
    EXPECT(INVALID, caustica_scene_add_sphere(device, scene, 0, material, m, NULL, &none));
    EXPECT(INVALID, caustica_scene_add_sphere(device, scene, INFINITY, material, m, NULL, &none));
    EXPECT(INVALID, caustica_scene_add_sphere(device, scene, 1, material, m, "\xff", &none));
    WITH(m[7], NAN, INVALID, caustica_scene_add_mesh(device, scene, mesh, material, m, NULL, &none));
    WITH(m[7], NAN, INVALID, caustica_instance_set_transform(device, instance, m));
    TRUE(none.id == 0);

    DEVICES(caustica_instance_set_transform(d, instance, m));
    HANDLES(instance, CAUSTICA_OBJECT_INSTANCE, caustica_instance_set_transform(device, h, m));
    DEVICES(caustica_instance_set_material(d, instance, material));
    HANDLES(instance, CAUSTICA_OBJECT_INSTANCE, caustica_instance_set_material(device, h, material));
    HANDLES(material, CAUSTICA_OBJECT_MATERIAL, caustica_instance_set_material(device, instance, h));
    EXPECT(INVALID, caustica_instance_set_visible(device, instance, 2));
    DEVICES(caustica_instance_set_visible(d, instance, 1));
    HANDLES(instance, CAUSTICA_OBJECT_INSTANCE, caustica_instance_set_visible(device, h, 1));
    DEVICES(caustica_instance_remove(d, instance));
    HANDLES(instance, CAUSTICA_OBJECT_INSTANCE, caustica_instance_remove(device, h));
}

static void light_and_camera_calls(void) {
    const caustica_scene scene = {living[CAUSTICA_OBJECT_SCENE]};
    const caustica_light light = {living[CAUSTICA_OBJECT_LIGHT]};
    const caustica_camera camera = {living[CAUSTICA_OBJECT_CAMERA]};
    caustica_light_desc ld = light_desc();
    caustica_camera_desc cd = camera_desc();
    caustica_camera_desc got = {.struct_size = sizeof got};
    caustica_camera found = {0};
    uint64_t count = 77;

    DEVICES(caustica_scene_add_light(d, scene, &ld, NULL));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, caustica_scene_add_light(device, h, &ld, NULL));
    EXPECT(INVALID, caustica_scene_add_light(device, scene, NULL, NULL));
    SIZES(ld, caustica_scene_add_light(device, scene, &ld, NULL));
    WITH(ld.kind, 0, INVALID, caustica_scene_add_light(device, scene, &ld, NULL));
    WITH(ld.kind, 4, INVALID, caustica_light_set(device, light, &ld));
    WITH(ld.reserved, 4, INVALID, caustica_light_set(device, light, &ld));
    DEVICES(caustica_light_set(d, light, &ld));
    HANDLES(light, CAUSTICA_OBJECT_LIGHT, caustica_light_set(device, h, &ld));
    DEVICES(caustica_light_remove(d, light));
    HANDLES(light, CAUSTICA_OBJECT_LIGHT, caustica_light_remove(device, h));

    DEVICES(caustica_scene_add_camera(d, scene, &cd, NULL));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, caustica_scene_add_camera(device, h, &cd, NULL));
    EXPECT(INVALID, caustica_scene_add_camera(device, scene, NULL, NULL));
    SIZES(cd, caustica_scene_add_camera(device, scene, &cd, NULL));
    WITH(cd.projection, 0, INVALID, caustica_scene_add_camera(device, scene, &cd, NULL));
    WITH(cd.projection, 3, INVALID, caustica_camera_set(device, camera, &cd));
    WITH(cd.transform[3], INFINITY, INVALID, caustica_camera_set(device, camera, &cd));
    DEVICES(caustica_camera_set(d, camera, &cd));
    HANDLES(camera, CAUSTICA_OBJECT_CAMERA, caustica_camera_set(device, h, &cd));
    DEVICES(caustica_camera_get(d, camera, &got));
    HANDLES(camera, CAUSTICA_OBJECT_CAMERA, caustica_camera_get(device, h, &got));
    EXPECT(INVALID, caustica_camera_get(device, camera, NULL));
    SIZES(got, caustica_camera_get(device, camera, &got));
    DEVICES(caustica_camera_remove(d, camera));
    HANDLES(camera, CAUSTICA_OBJECT_CAMERA, caustica_camera_remove(device, h));

    DEVICES(caustica_scene_camera_count(d, scene, &count));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, caustica_scene_camera_count(device, h, &count));
    EXPECT(INVALID, caustica_scene_camera_count(device, scene, NULL));
    DEVICES(caustica_scene_camera(d, scene, 0, &found));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, caustica_scene_camera(device, h, 0, &found));
    EXPECT(INVALID, caustica_scene_camera(device, scene, 1, &found));
    EXPECT(INVALID, caustica_scene_camera(device, scene, UINT64_MAX, &found));
    EXPECT(INVALID, caustica_scene_camera(device, scene, 0, NULL));
    TRUE(found.id == 0 && count == 77);
}

/* What the commit finds. The last snapshot stays, and the details name what is wrong. */
static void commit_errors(void) {
    const caustica_scene scene = {living[CAUSTICA_OBJECT_SCENE]};
    const caustica_light light = {living[CAUSTICA_OBJECT_LIGHT]};
    const caustica_camera camera = {living[CAUSTICA_OBJECT_CAMERA]};
    const caustica_material material = {living[CAUSTICA_OBJECT_MATERIAL]};
    const uint32_t far_indices[] = {0, 1, 812};
    float lost[] = {-1, 0, -1, -1, NAN, 1, 1, 0, 1};
    caustica_light_desc ld = light_desc();
    caustica_camera_desc cd = camera_desc();
    caustica_material_desc md = material_desc();
    caustica_mesh_desc bad = mesh_desc();
    caustica_detail detail;
    caustica_mesh mesh;
    caustica_instance instance;
    detail.struct_size = sizeof detail;

    for (int round = 0; round < 2; ++round) {
        if (round == 0) bad.indices = far_indices;
        else bad.indices = triangle, bad.positions = lost;
        bad.name = "broken";
        EXPECT(CAUSTICA_OK, caustica_mesh_create(device, &bad, &mesh));
        EXPECT(CAUSTICA_OK, caustica_scene_add_mesh(device, scene, mesh, material, NULL, NULL, &instance));
        EXPECT(INVALID, caustica_scene_commit(device, scene, NULL));
        EXPECT(CAUSTICA_OK, caustica_last_error(device, &detail));
        TRUE(detail.object_kind == CAUSTICA_OBJECT_MESH && detail.object_id == mesh.id);
        TRUE(strcmp(detail.object_name, "broken") == 0 && detail.index != CAUSTICA_NO_INDEX);
        TRUE(strcmp(detail.parameter, round == 0 ? "indices[2]" : "positions[1].y") == 0);
        TRUE(strstr(detail.text, detail.parameter) != NULL && strstr(detail.text, "broken") != NULL);
        EXPECT(CAUSTICA_OK, caustica_mesh_release(device, mesh));
        EXPECT(CAUSTICA_OK, caustica_instance_remove(device, instance));
    }

    ld.intensity[1] = NAN;
    EXPECT(CAUSTICA_OK, caustica_light_set(device, light, &ld));
    EXPECT(INVALID, caustica_scene_commit(device, scene, NULL));
    EXPECT(CAUSTICA_OK, caustica_last_error(device, &detail));
    TRUE(detail.object_kind == CAUSTICA_OBJECT_LIGHT && detail.object_id == light.id);
    ld = light_desc();
    EXPECT(CAUSTICA_OK, caustica_light_set(device, light, &ld));

    cd.yfov = -1;
    EXPECT(CAUSTICA_OK, caustica_camera_set(device, camera, &cd));
    EXPECT(INVALID, caustica_scene_commit(device, scene, NULL));
    EXPECT(CAUSTICA_OK, caustica_last_error(device, &detail));
    TRUE(detail.object_kind == CAUSTICA_OBJECT_CAMERA && detail.object_id == camera.id);
    cd = camera_desc();
    EXPECT(CAUSTICA_OK, caustica_camera_set(device, camera, &cd));

    md.color[2] = 1.5f;
    EXPECT(CAUSTICA_OK, caustica_material_set(device, material, &md));
    EXPECT(INVALID, caustica_scene_commit(device, scene, NULL));
    EXPECT(CAUSTICA_OK, caustica_last_error(device, &detail));
    TRUE(detail.object_kind == CAUSTICA_OBJECT_MATERIAL && detail.object_id == material.id);
    TRUE(strcmp(detail.parameter, "color.b") == 0 || strcmp(detail.parameter, "color[2]") == 0);
    md = material_desc();
    md.model = CAUSTICA_MATERIAL_DIELECTRIC;
    md.abbe_number_outside = 0.5f;
    EXPECT(CAUSTICA_OK, caustica_material_set(device, material, &md));
    EXPECT(INVALID, caustica_scene_commit(device, scene, NULL));
    EXPECT(CAUSTICA_OK, caustica_last_error(device, &detail));
    TRUE(strcmp(detail.parameter, "abbe_number_outside") == 0);
    md = material_desc();
    EXPECT(CAUSTICA_OK, caustica_material_set(device, material, &md));
    EXPECT(CAUSTICA_OK, caustica_scene_commit(device, scene, NULL));
}

static void render_calls(void) {
    const caustica_render_job over = {living[CAUSTICA_OBJECT_RENDER]};
    const caustica_camera camera = {living[CAUSTICA_OBJECT_CAMERA]};
    caustica_render_job render = {0};
    caustica_render_desc desc;
    caustica_caustic_options options;
    caustica_detail detail;
    caustica_progress progress;
    caustica_statistics statistics;
    caustica_pixels pixels;
    caustica_scene empty;
    caustica_camera other;
    caustica_camera_desc cd = camera_desc();
    float data[16];
    memset(&desc, 0, sizeof desc);
    memset(&pixels, 0, sizeof pixels);
    desc.struct_size = sizeof desc;
    desc.scene.id = living[CAUSTICA_OBJECT_SCENE];
    desc.camera = camera;
    desc.width = desc.height = desc.samples = 2;
    progress.struct_size = sizeof progress;
    statistics.struct_size = sizeof statistics;
    pixels.struct_size = sizeof pixels;
    pixels.format = CAUSTICA_FORMAT_RGBA_F32;
    pixels.data = data;
    pixels.size = sizeof data;

    DEVICES(caustica_render(d, &desc, &render));
    DEVICES(caustica_render_start(d, &desc, &render));
    EXPECT(INVALID, caustica_render(device, NULL, &render));
    EXPECT(INVALID, caustica_render(device, &desc, NULL));
    EXPECT(INVALID, caustica_render_start(device, NULL, &render));
    EXPECT(INVALID, caustica_render_start(device, &desc, NULL));
    SIZES(desc, caustica_render(device, &desc, &render));
    SIZES(desc, caustica_render_start(device, &desc, &render));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, (desc.scene = h, caustica_render(device, &desc, &render)));
    HANDLES(scene, CAUSTICA_OBJECT_SCENE, (desc.scene = h, caustica_render_start(device, &desc, &render)));
    desc.scene.id = living[CAUSTICA_OBJECT_SCENE];
    for (size_t i = 1; i < 10; ++i) { /* id 0 is the first camera */
        desc.camera.id = wrong_id(i, CAUSTICA_OBJECT_CAMERA);
        EXPECT(CAUSTICA_ERROR_INVALID_HANDLE, caustica_render(device, &desc, &render));
    }
    EXPECT(CAUSTICA_OK, caustica_scene_create(device, &empty));
    EXPECT(CAUSTICA_OK, caustica_scene_add_camera(device, empty, &cd, &other));
    WITH(desc.scene, empty, CAUSTICA_ERROR_WRONG_STATE, caustica_render(device, &desc, &render));
    WITH(desc.camera, other, CAUSTICA_ERROR_WRONG_STATE, caustica_render(device, &desc, &render));
    EXPECT(CAUSTICA_OK, caustica_scene_release(device, empty));
    WITH(desc.camera, other, CAUSTICA_ERROR_INVALID_HANDLE, caustica_render(device, &desc, &render));
    desc.camera = camera;
    WITH(desc.integrator, 6, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.caustics_only, 2, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.num_threads, UINT32_MAX, CAUSTICA_ERROR_LIMIT, caustica_render(device, &desc, &render));
    WITH(desc.time_limit_seconds, NAN, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.noise_limit, NAN, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.noise_limit, -1, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.time_limit_seconds, -1, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.width, UINT32_MAX, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.width, 0, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.height, 0, INVALID, caustica_render_start(device, &desc, &render));
    WITH(desc.max_depth, UINT32_MAX, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.clamp, NAN, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.clamp, -1, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.transparent, 2, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.reserved, 1, INVALID, caustica_render(device, &desc, &render));
    caustica_camera_desc view = cd;
    desc.camera_desc = &view;
    EXPECT(INVALID, caustica_render(device, &desc, &render)); /* beside a camera */
    desc.camera.id = 0;
    SIZES(view, caustica_render(device, &desc, &render));
    WITH(view.projection, 0, INVALID, caustica_render(device, &desc, &render));
    WITH(view.yfov, 4, INVALID, caustica_render(device, &desc, &render));
    WITH(view.shift[1], NAN, INVALID, caustica_render(device, &desc, &render));
    /* A lens without a focus, none that is a lens, one before parallel rays. */
    WITH(view.lens_radius, 1, INVALID, caustica_render(device, &desc, &render));
    view.focus_distance = 2;
    WITH(view.lens_radius, NAN, INVALID, caustica_render(device, &desc, &render));
    WITH(view.lens_radius, -1, INVALID, caustica_render(device, &desc, &render));
    WITH(view.lens_radius, INFINITY, INVALID, caustica_render(device, &desc, &render));
    view.lens_radius = 1;
    WITH(view.focus_distance, NAN, INVALID, caustica_render(device, &desc, &render));
    view.ymag = 1;
    WITH(view.projection, CAUSTICA_CAMERA_ORTHOGRAPHIC, INVALID, caustica_render(device, &desc, &render));
    view.lens_radius = 0;
    WITH(view.transform[3], NAN, INVALID, caustica_render_start(device, &desc, &render));
    desc.camera_desc = NULL;
    desc.camera = camera;
    desc.transparent = 1;
    WITH(desc.integrator, CAUSTICA_INTEGRATOR_LIGHT, INVALID, caustica_render(device, &desc, &render));
    desc.transparent = 0;
    WITH(desc.features, 2, INVALID, caustica_render(device, &desc, &render));
    desc.features = 1;
    WITH(desc.integrator, CAUSTICA_INTEGRATOR_LIGHT, INVALID, caustica_render(device, &desc, &render));
    desc.features = 0;
    WITH(desc.first_sample, UINT32_MAX, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.region.x, 1, INVALID, caustica_render(device, &desc, &render));
    WITH(desc.region.width, 1, INVALID, caustica_render_start(device, &desc, &render));
    desc.region.width = desc.region.height = UINT32_MAX;
    EXPECT(INVALID, caustica_render(device, &desc, &render));
    WITH(desc.region.y, UINT32_MAX, INVALID, caustica_render(device, &desc, &render));
    memset(&desc.region, 0, sizeof desc.region);
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    desc.caustic_options = &options;
    SIZES(options, caustica_render(device, &desc, &render));
    SIZES(options, caustica_render_start(device, &desc, &render));
    WITH(options.geometry_term, 2, INVALID, caustica_render(device, &desc, &render));
    WITH(options.check, 3, INVALID, caustica_render(device, &desc, &render));
    WITH(options.check, CAUSTICA_CHECK_FEW, INVALID, caustica_render(device, &desc, &render));
    WITH(options.roulette, 3, INVALID, caustica_render(device, &desc, &render));
    WITH(options.roulette_threshold, NAN, INVALID, caustica_render(device, &desc, &render));
    WITH(options.roulette_threshold, -1, INVALID, caustica_render(device, &desc, &render));
    WITH(options.seeds, 4, INVALID, caustica_render(device, &desc, &render));
    WITH(options.search, 1.5f, INVALID, caustica_render(device, &desc, &render));
    WITH(options.search, NAN, INVALID, caustica_render(device, &desc, &render));
    WITH(options.aim, 1, INVALID, caustica_render(device, &desc, &render));
    WITH(options.aim, NAN, INVALID, caustica_render(device, &desc, &render));
    WITH(options.light_subpaths, -1, INVALID, caustica_render(device, &desc, &render));
    WITH(options.light_subpaths, NAN, INVALID, caustica_render(device, &desc, &render));
    WITH(options.walk_iterations, 4097, INVALID, caustica_render(device, &desc, &render));
    WITH(options.walk_tolerance, 1e-300, INVALID, caustica_render(device, &desc, &render));
    options.walk_tolerance = 1e-4;
    EXPECT(INVALID, caustica_render(device, &desc, &render));
    detail.struct_size = sizeof detail;
    EXPECT(CAUSTICA_OK, caustica_last_error(device, &detail));
    TRUE(strcmp(detail.parameter, "walk_tolerance") == 0);
    options.walk_tolerance = -1;
    EXPECT(INVALID, caustica_render(device, &desc, &render));
    desc.caustic_options = NULL;
    TRUE(render.id == 0);

    WITH(desc.height, UINT32_MAX, INVALID, caustica_render_start(device, &desc, &render));
    TRUE(render.id == 0);

    DEVICES(caustica_render_poll(d, over, &progress));
    HANDLES(render_job, CAUSTICA_OBJECT_RENDER, caustica_render_poll(device, h, &progress));
    EXPECT(INVALID, caustica_render_poll(device, over, NULL));
    SIZES(progress, caustica_render_poll(device, over, &progress));
    DEVICES(caustica_render_wait(d, over, 0));
    HANDLES(render_job, CAUSTICA_OBJECT_RENDER, caustica_render_wait(device, h, -1));
    EXPECT(INVALID, caustica_render_wait(device, over, NAN));
    EXPECT(CAUSTICA_OK, caustica_render_wait(device, over, INFINITY));
    DEVICES(caustica_render_cancel(d, over));
    HANDLES(render_job, CAUSTICA_OBJECT_RENDER, caustica_render_cancel(device, h));
    DEVICES(caustica_render_result(d, over, NULL));
    HANDLES(render_job, CAUSTICA_OBJECT_RENDER, caustica_render_result(device, h, NULL));
    SIZES(statistics, caustica_render_result(device, over, &statistics));
    EXPECT(CAUSTICA_OK, caustica_render_result(device, over, NULL));

    DEVICES(caustica_render_read(d, over, &pixels));
    HANDLES(render_job, CAUSTICA_OBJECT_RENDER, caustica_render_read(device, h, &pixels));
    EXPECT(INVALID, caustica_render_read(device, over, NULL));
    SIZES(pixels, caustica_render_read(device, over, &pixels));
    WITH(pixels.format, 0, INVALID, caustica_render_read(device, over, &pixels));
    WITH(pixels.image, 4, INVALID, caustica_render_read(device, over, &pixels));
    WITH(pixels.image, CAUSTICA_IMAGE_NORMAL, INVALID, caustica_render_read(device, over, &pixels)); /* not asked for */
    WITH(pixels.reserved, 1, INVALID, caustica_render_read(device, over, &pixels));
    WITH(pixels.data, NULL, INVALID, caustica_render_read(device, over, &pixels));
    WITH(pixels.size, sizeof data - 1, INVALID, caustica_render_read(device, over, &pixels));
    WITH(pixels.row_stride, 31, INVALID, caustica_render_read(device, over, &pixels));
    WITH(pixels.row_stride, UINT64_MAX, INVALID, caustica_render_read(device, over, &pixels));
    EXPECT(CAUSTICA_OK, caustica_render_read(device, over, &pixels));
    TRUE(data[3] == 1 && data[15] == 1);

    DEVICES(caustica_render_write(d, over, "x.exr"));
    HANDLES(render_job, CAUSTICA_OBJECT_RENDER, caustica_render_write(device, h, "x.exr"));
    EXPECT(INVALID, caustica_render_write(device, over, NULL));
    EXPECT(CAUSTICA_ERROR_UNSUPPORTED, caustica_render_write(device, over, "x.unknown"));
    EXPECT(CAUSTICA_ERROR_IO, caustica_render_write(device, over, "no such directory/x.exr"));
    DEVICES(caustica_render_release(d, over));
    HANDLES(render_job, CAUSTICA_OBJECT_RENDER, caustica_render_release(device, h));
}

int main(void) {
    caustica_device_options options;
    caustica_device *neighbour, *released;
    caustica_detail detail;
    int local = 0;
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    options.version = CAUSTICA_VERSION;
    options.num_threads = 1;
    detail.struct_size = sizeof detail;
    EXPECT(CAUSTICA_OK, caustica_device_create(&options, &device));
    EXPECT(CAUSTICA_OK, caustica_device_create(&options, &neighbour));
    EXPECT(CAUSTICA_OK, caustica_device_create(&options, &released));
    EXPECT(CAUSTICA_OK, caustica_device_release(released));
    wrong_devices[0] = NULL;
    wrong_devices[1] = released;
    wrong_devices[2] = (caustica_device*)16;
    wrong_devices[3] = (caustica_device*)(void*)&local;
    wrong_devices[4] = (caustica_device*)UINTPTR_MAX;

    make_all(device, stale);
    release_all(device, stale);
    make_all(device, living);
    make_all(neighbour, foreign);

    device_calls();
    mesh_calls();
    texture_calls();
    material_calls();
    scene_calls();
    light_and_camera_calls();
    commit_errors();
    render_calls();

    /* The record is per device, and a success leaves it. */
    EXPECT(INVALID, caustica_mesh_create(device, NULL, NULL));
    EXPECT(CAUSTICA_OK, caustica_last_error(neighbour, &detail));
    TRUE(detail.code == CAUSTICA_OK);
    EXPECT(CAUSTICA_OK, caustica_last_error(device, &detail));
    TRUE(detail.code == INVALID && strcmp(detail.parameter, "mesh") == 0);

    release_all(device, living);
    EXPECT(CAUSTICA_OK, caustica_device_release(device));
    EXPECT(CAUSTICA_OK, caustica_device_release(neighbour)); /* with objects alive */
    if (failures == 0) puts("ok");
    return failures != 0;
}

/* minimal [image.exr [scene.glb]]: a glass sphere over a diffuse floor, or the scene of a file, rendered
 * through the shared library in plain C11. Prints the mean luminance. */
#include "caustica.h"
#include <stdio.h>
#include <stdlib.h>

static caustica_device* device;

static void check(caustica_result result) {
    caustica_detail detail = {.struct_size = sizeof detail};
    if (result == CAUSTICA_OK) return;
    caustica_last_error(NULL, &detail);
    fprintf(stderr, "%s: %s\n", caustica_result_text(result), detail.text);
    exit(1);
}

static caustica_material material(uint32_t model, float color, float emission) {
    caustica_material_desc desc = {.struct_size = sizeof desc};
    caustica_material made;
    check(caustica_material_desc_init(&desc, model));
    for (int c = 0; c < 3; ++c) desc.color[c] = color, desc.emission[c] = emission;
    check(caustica_material_create(device, &desc, &made));
    return made;
}

static void build(caustica_scene scene) {
    static const float corners[] = {-2, 0, -2, -2, 0, 2, 2, 0, 2, 2, 0, -2};
    static const uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
    static const double above[] = {1, 0, 0, 0, 0, 1, 0, 0.6, 0, 0, 1, 0};
    static const double lamp[] = {1, 0, 0, 1, 0, 1, 0, 3, 0, 0, 1, 0};
    caustica_mesh_desc mesh = {.struct_size = sizeof mesh, .positions = corners, .vertex_count = 4,
                               .indices = triangles, .index_count = 6, .name = "floor"};
    caustica_camera_desc camera = {.struct_size = sizeof camera, .projection = CAUSTICA_CAMERA_PERSPECTIVE, .yfov = 0.7,
                                   .transform = {1, 0, 0, 0, 0, 0.8, 0.6, 3, 0, -0.6, 0.8, 4}};
    caustica_mesh floor;
    check(caustica_mesh_create(device, &mesh, &floor));
    check(caustica_scene_add_mesh(device, scene, floor, material(CAUSTICA_MATERIAL_DIFFUSE, 0.6f, 0), NULL, "floor", NULL));
    check(caustica_scene_add_sphere(device, scene, 0.5, material(CAUSTICA_MATERIAL_DIELECTRIC, 1, 0), above, "glass", NULL));
    check(caustica_scene_add_sphere(device, scene, 0.1, material(CAUSTICA_MATERIAL_DIFFUSE, 0, 200), lamp, "lamp", NULL));
    check(caustica_scene_add_camera(device, scene, &camera, NULL));
}

int main(int argc, char** argv) {
    static float pixels[96 * 128][3];
    double sum = 0;
    caustica_device_options options = {.struct_size = sizeof options, .version = CAUSTICA_VERSION};
    caustica_pixels target = {.struct_size = sizeof target, .format = CAUSTICA_FORMAT_RGB_F32, .data = pixels, .size = sizeof pixels};
    caustica_render_desc desc = {.struct_size = sizeof desc, .width = 128, .height = 96, .samples = 16, .seed = 7};
    caustica_render_job render;
    check(caustica_device_create(&options, &device));
    check(caustica_scene_create(device, &desc.scene));
    if (argc > 2) check(caustica_scene_load(device, desc.scene, argv[2], NULL));
    else build(desc.scene);
    check(caustica_scene_commit(device, desc.scene, NULL));
    check(caustica_render(device, &desc, &render));
    check(caustica_render_read(device, render, &target));
    if (argc > 1) check(caustica_render_write(device, render, argv[1]));
    for (int i = 0; i < 96 * 128; ++i) sum += 0.2126 * pixels[i][0] + 0.7152 * pixels[i][1] + 0.0722 * pixels[i][2];
    printf("mean luminance %.9g\n", sum / (96 * 128));
    check(caustica_device_release(device));
    return 0;
}

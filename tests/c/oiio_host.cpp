// A host that uses OpenImageIO itself: its settings are its own, whatever Caustica writes.
#include "caustica.h"
#include <OpenImageIO/imageio.h>
#include <cstdio>
#include <cstdlib>

static caustica_device* device;

static void check(caustica_result result)
{
    caustica_detail detail {};
    detail.struct_size = sizeof detail;
    if (result == CAUSTICA_OK)
        return;
    caustica_last_error(nullptr, &detail);
    std::fprintf(stderr, "%s: %s\n", caustica_result_text(result), detail.text);
    std::exit(1);
}

int main()
{
    OIIO::attribute("threads", 7);
    OIIO::attribute("exr_threads", 3);

    caustica_device_options options {};
    options.struct_size = sizeof options;
    options.version     = CAUSTICA_VERSION;
    check(caustica_device_create(&options, &device));
    caustica_render_desc desc {};
    desc.struct_size = sizeof desc;
    desc.width = desc.height = 8;
    desc.samples             = 1;
    check(caustica_scene_create(device, &desc.scene));
    const float sky[3] = { 1, 1, 1 };
    check(caustica_scene_set_environment(device, desc.scene, sky));
    caustica_camera_desc camera {};
    camera.struct_size = sizeof camera;
    camera.projection  = CAUSTICA_CAMERA_PERSPECTIVE;
    camera.yfov        = 0.7;
    for (int i : { 0, 5, 10 })
        camera.transform[i] = 1;
    check(caustica_scene_add_camera(device, desc.scene, &camera, nullptr));
    check(caustica_scene_commit(device, desc.scene, nullptr));
    caustica_render_job render;
    check(caustica_render(device, &desc, &render));
    for (const char* file : { "a.png", "a.tif", "a.jpg", "a.hdr", "a.exr" })
        check(caustica_render_write(device, render, file));
    check(caustica_device_release(device));

    int threads = 0, exr_threads = 0;
    OIIO::getattribute("threads", threads);
    OIIO::getattribute("exr_threads", exr_threads);
    std::printf("threads %d, exr_threads %d\n", threads, exr_threads);
}

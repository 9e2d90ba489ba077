/* caustica.h: the C interface of Caustica, a renderer for refractive caustics.
 *
 * C11 and C++17. SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * The rules
 *
 * Units.      Metres, right-handed, y up as in glTF. Radiance in W/(m^2 sr) per channel, linear
 *             Rec. 709. Angles in radians. Image row 0 is the top.
 * Transforms. 3x4, row-major, double: m[4*row + column], for column vectors; the last column is the
 *             translation. NULL is the identity.
 * Device.     Every call takes the device that owns its objects. Nothing is global: the library
 *             prints nothing, reads no environment variable that changes a result, and leaves signal
 *             handlers and the floating-point state of its callers as they are. It computes with
 *             the default floating-point state whatever flags the host was compiled with.
 * Handles.    An id in a struct, one type per kind of object; id 0 is "none". A released, foreign or
 *             invented handle or device is an error (CAUSTICA_ERROR_INVALID_HANDLE), never a crash.
 * Lifetime.   The host's claim ends with the release. What still refers to an object keeps it: a mesh
 *             and a material live as long as an instance shows them, a texture as long as a material
 *             has it. Instances, lights and cameras
 *             belong to one scene and end with it.
 * Commits.    A change in a scene or to any object in it takes effect for renders that are started
 *             after the next caustica_scene_commit. A running render keeps the snapshot it started
 *             with, so the host may edit at once.
 * Results.    CAUSTICA_OK, more than 0 for information, less than 0 for an error. A call that fails
 *             changes nothing, writes nothing to its outputs, and leaves its details for
 *             caustica_last_error on the same thread.
 * Structs.    The host sets struct_size = sizeof(the struct) in every struct it passes, in or out,
 *             and zeroes the rest before it fills in what it needs. Later versions append fields;
 *             zero in them means what the earlier version did. "reserved" must be 0.
 * Memory in.  Read during the call only, any alignment. A pointer is NULL or valid. Strings are UTF-8
 *             and end with NUL; NULL is the empty string; names have at most 1023 bytes, paths 4095.
 * Memory out. Copied to the host's memory. There is nothing of the library's for the host to free.
 * No memory.  Meshes, images, acceleration structures and films that find none give CAUSTICA_ERROR_OUT_OF_MEMORY. Where a few
 *             kilobytes are missing, the process ends, as Rust programs do.
 * Threads.    Any thread may call any function, and all run concurrently. Those that change the same scene wait for each
 *             other, for moments. A commit copies the scene first, and what changes meanwhile may or may not be in the
 *             snapshot; while it builds, another commit and the release of the scene give CAUSTICA_ERROR_BUSY. A device
 *             must not be used any more when its release begins.
 *             A calling thread needs 256 kB of stack. The threads of a render have the signal mask of the one
 *             that starts it.
 * Callbacks.  Never called with a lock held that another call waits for, and not after the release of what they were given to.
 *             They must return, and not throw or longjmp. Inside of one only the functions marked
 *             "callback-safe" may be called; the others give CAUSTICA_ERROR_WRONG_STATE.
 * Fork.       A child cannot use the devices of its parent and gets an error. It may create its own
 *             unless another thread of the parent was inside this library at the fork. After a commit
 *             on several threads or the first .png, .tif, .jpg or .hdr of the parent, also inside a
 *             scene file, the child must end by _exit or exec: what TBB and OpenImageIO do at exit waits for threads it has not.
 * Unloading.  The library stays in the process after dlclose. No thread of it is left after the release
 *             of the last device; Embree's commits on several threads leave idle workers of TBB, and
 *             the first .png, .tif, .jpg or .hdr, also inside a scene file, loads OpenImageIO with its
 *             libraries and threads: these belong to the process.
 */
#ifndef CAUSTICA_H
#define CAUSTICA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Version -------------------------------------------------------------------------------- */

#define CAUSTICA_VERSION_MAJOR 0
#define CAUSTICA_VERSION_MINOR 1
#define CAUSTICA_VERSION_PATCH 0
/* Major in bits 22 to 31, minor in 12 to 21, patch in 0 to 11. */
#define CAUSTICA_VERSION 4096

/* The library's own CAUSTICA_VERSION. Callback-safe. */
uint32_t caustica_version(void);

/* ---- Results -------------------------------------------------------------------------------- */

typedef int32_t caustica_result;

enum {
    CAUSTICA_OK = 0,
    CAUSTICA_TIMEOUT = 1,   /* not over within the time given */
    CAUSTICA_CANCELLED = 2, /* ended early at the host's wish; the passes that were whole are valid */

    CAUSTICA_ERROR_INVALID_ARGUMENT = -1,
    CAUSTICA_ERROR_INVALID_HANDLE = -2, /* null, released, foreign or of another kind */
    CAUSTICA_ERROR_WRONG_STATE = -3,    /* not now */
    CAUSTICA_ERROR_UNSUPPORTED = -4,    /* not in this build */
    CAUSTICA_ERROR_OUT_OF_MEMORY = -5,
    CAUSTICA_ERROR_IO = -6,
    CAUSTICA_ERROR_INCOMPATIBLE_VERSION = -7, /* header and library, or library and ray tracer */
    CAUSTICA_ERROR_INTERNAL = -8,             /* a bug of the library; the process lives */
    CAUSTICA_ERROR_BUSY = -9,                 /* another thread is working on the object */
    CAUSTICA_ERROR_LIMIT = -10,               /* more than the library can hold */
    CAUSTICA_ERROR_BACKEND = -11              /* the ray tracer failed */
};

/* A few words on a code, a static string. Callback-safe. */
const char* caustica_result_text(caustica_result result);

/* How the library was built: version, architecture, backends. Writes what fits into `capacity` bytes
 * with a NUL, and the length without it to `length`; either may be NULL. */
caustica_result caustica_build_info(char* text, uint64_t capacity, uint64_t* length);

/* Kinds of objects in caustica_detail. */
enum {
    CAUSTICA_OBJECT_NONE = 0,
    CAUSTICA_OBJECT_DEVICE = 1,
    CAUSTICA_OBJECT_MESH = 2,
    CAUSTICA_OBJECT_MATERIAL = 3,
    CAUSTICA_OBJECT_SCENE = 4,
    CAUSTICA_OBJECT_INSTANCE = 5,
    CAUSTICA_OBJECT_LIGHT = 6,
    CAUSTICA_OBJECT_CAMERA = 7,
    CAUSTICA_OBJECT_RENDER = 8,
    CAUSTICA_OBJECT_TEXTURE = 9
};

/* caustica_detail::index when no element of a list is concerned. */
#define CAUSTICA_NO_INDEX UINT64_MAX

/* What happened, for programs and for people. Text that is too long is cut. */
typedef struct caustica_detail {
    uint32_t struct_size;
    caustica_result code;
    uint32_t object_kind; /* CAUSTICA_OBJECT_ */
    uint32_t reserved;
    uint64_t object_id;    /* its handle's id; 0 if it has none */
    uint64_t index;        /* element of the list that `parameter` names, or CAUSTICA_NO_INDEX */
    char object_name[64];  /* as the host named it */
    char parameter[64];    /* parameter or field, e.g. "positions[812].y" */
    char text[512];        /* a sentence: what, where, which value, what was expected */
} caustica_detail;

/* ---- Handles -------------------------------------------------------------------------------- */

typedef struct caustica_device caustica_device;

typedef struct { uint64_t id; } caustica_texture;
typedef struct { uint64_t id; } caustica_mesh;
typedef struct { uint64_t id; } caustica_material;
typedef struct { uint64_t id; } caustica_scene;
typedef struct { uint64_t id; } caustica_instance;
typedef struct { uint64_t id; } caustica_light;
typedef struct { uint64_t id; } caustica_camera;
typedef struct { uint64_t id; } caustica_render_job;

/* The last failed call of the calling thread, if it was one with `device`; with NULL, whatever it was: with
 * any device or without one, as a creation is. Code CAUSTICA_OK if there is none: a thread remembers one
 * failure, so ask before the next. A call that succeeds does not clear it. Its own failure is only
 * returned. Callback-safe. */
caustica_result caustica_last_error(caustica_device* device, caustica_detail* detail);

/* ---- Device --------------------------------------------------------------------------------- */

enum {
    CAUSTICA_BACKEND_DEFAULT = 0, /* Embree where it is built in */
    CAUSTICA_BACKEND_EMBREE = 1,
    CAUSTICA_BACKEND_OBVHS = 2
};

enum { CAUSTICA_SEVERITY_INFO = 1, CAUSTICA_SEVERITY_WARNING = 2, CAUSTICA_SEVERITY_ERROR = 3 };

/* Receives what renders of a scene cannot find (info), warnings, and every error that a call or a render on the
 * device ends with. Not calls inside of this callback, nor CAUSTICA_ERROR_BUSY, nor that a render still runs or has no
 * image yet, which a host may try as often as it likes. What a commit says is not said again by the next of the same
 * scene. Called on the thread of that call, or on the render's thread: possibly on several at once. `detail` is valid
 * during the call. */
typedef void (*caustica_message_callback)(void* user, uint32_t severity, const caustica_detail* detail);

typedef struct caustica_device_options {
    uint32_t struct_size;
    uint32_t version;     /* CAUSTICA_VERSION, required: tells the library which header this is; before 1.0 the
                             minor versions must be equal, from then on the header's may be older */
    uint32_t num_threads; /* per commit and per render, at most 4096; 0: as many as the process may use */
    uint32_t backend;     /* CAUSTICA_BACKEND_ */
    caustica_message_callback message; /* or NULL */
    void* user;
} caustica_device_options;

/* Makes a device, after a try whether its ray tracer works. */
caustica_result caustica_device_create(const caustica_device_options* options, caustica_device** device);

/* Ends a device: cancels its renders, waits for them, frees all objects. Objects that the host had not
 * released are counted in a message. When it returns, no thread of the device is left. */
caustica_result caustica_device_release(caustica_device* device);

/* ---- Meshes --------------------------------------------------------------------------------- */

/* Triangles, counter-clockwise seen from the front. An array may be NULL if its count is 0, and is not read
 * then; normals may be NULL for flat shading. */
typedef struct caustica_mesh_desc {
    uint32_t struct_size;
    uint32_t reserved;
    const char* name;         /* for messages */
    const float* positions;   /* x, y, z */
    uint64_t position_stride; /* bytes from one to the next; 0: 12 */
    const float* normals;     /* x, y, z of any length but 0, one per vertex; or NULL */
    uint64_t normal_stride;   /* bytes from one to the next; 0: 12 */
    uint64_t vertex_count;
    const uint32_t* indices; /* three per triangle */
    uint64_t index_count;    /* a multiple of 3 */
    const float* texture_coordinates;   /* u, v; (0, 0) is the upper left corner of an image, (1, 1) the lower
                                           right one, as in glTF; one pair per vertex, or NULL */
    uint64_t texture_coordinate_stride; /* bytes from one pair to the next; 0: 8 */
} caustica_mesh_desc;

/* Makes a mesh from copies of the arrays. Whether their values make sense is checked by the commit of
 * a scene that shows the mesh. */
caustica_result caustica_mesh_create(caustica_device* device, const caustica_mesh_desc* desc, caustica_mesh* mesh);

/* Replaces all values, for all instances that show the mesh, from the next commit of their scenes on. */
caustica_result caustica_mesh_set(caustica_device* device, caustica_mesh mesh, const caustica_mesh_desc* desc);

caustica_result caustica_mesh_release(caustica_device* device, caustica_mesh mesh);

/* ---- Textures ------------------------------------------------------------------------------- */

enum {
    CAUSTICA_TEXELS_SRGB8 = 1,   /* three bytes: a colour, by the transfer function of sRGB */
    CAUSTICA_TEXELS_LINEAR8 = 2, /* three bytes: 0 to 1 */
    CAUSTICA_TEXELS_FLOAT = 3    /* three floats, linear, at least 0 */
};

enum {
    CAUSTICA_WRAP_REPEAT = 0,
    CAUSTICA_WRAP_MIRROR = 1, /* every other image is reversed */
    CAUSTICA_WRAP_CLAMP = 2   /* the texels of the edge */
};

enum {
    CAUSTICA_FILTER_LINEAR = 0, /* there are no smaller copies of an image: the samples of a pixel average it */
    CAUSTICA_FILTER_NEAREST = 1
};

/* An image, as texels or as a file (EXR; by OpenImageIO, PNG, TIFF, JPEG and HDR). */
typedef struct caustica_texture_desc {
    uint32_t struct_size;
    uint32_t format;       /* CAUSTICA_TEXELS_, required: of a file, SRGB8 says that integers are colours, the
                              others that they are numbers; a file's floats are linear in any case */
    const char* name;      /* for messages */
    uint32_t width;        /* of texels, 1 to 65536 */
    uint32_t height;
    const void* texels;    /* row by row from the top left; or NULL */
    uint64_t texel_stride; /* bytes from one texel to the next, 4 for RGBA in bytes; 0: 3 or 12 */
    const char* path;      /* or NULL */
    uint32_t wrap_u;       /* CAUSTICA_WRAP_, to the right and left */
    uint32_t wrap_v;
    uint32_t filter;       /* CAUSTICA_FILTER_ */
    uint32_t reserved;
} caustica_texture_desc;

/* Makes a texture from a copy of the texels, or from the file, which is read now. */
caustica_result caustica_texture_create(caustica_device* device, const caustica_texture_desc* desc,
                                        caustica_texture* texture);

/* Replaces all values, for all materials that have the texture, from the next commit of their scenes on. */
caustica_result caustica_texture_set(caustica_device* device, caustica_texture texture,
                                     const caustica_texture_desc* desc);

caustica_result caustica_texture_release(caustica_device* device, caustica_texture texture);

/* ---- Materials ------------------------------------------------------------------------------ */

enum {
    CAUSTICA_MATERIAL_DIFFUSE = 1,         /* Lambertian, both sides; uses color */
    CAUSTICA_MATERIAL_DIELECTRIC = 2,      /* boundary of a refracting solid or liquid; uses color, roughness,
                                              ior, ior_outside, absorption, absorption_outside, abbe_number, abbe_number_outside */
    CAUSTICA_MATERIAL_THIN_DIELECTRIC = 3, /* a sheet that transmits straight on; uses color, roughness, ior */
    CAUSTICA_MATERIAL_CONDUCTOR = 4,       /* a metal; uses color, roughness */
    CAUSTICA_MATERIAL_METALLIC_ROUGHNESS = 5 /* glTF 2.0 with KHR_materials_ior, _specular, _transmission,
                                                _volume and _dispersion; uses all but those of the outside */
};

/* Every model may emit. "Inside" is behind the surface, against its normal. */
typedef struct caustica_material_desc {
    uint32_t struct_size;
    uint32_t model;              /* CAUSTICA_MATERIAL_, required */
    const char* name;            /* for messages */
    float color[3];              /* diffuse: reflectance; conductor: reflectance at normal incidence;
                                    dielectric, thin dielectric: factor of transmitted light; glTF: base colour */
    float roughness;             /* perceptual, 0 to 1: the GGX width is its square; 0 is smooth */
    float ior;                   /* refractive index inside, 1 to 10; 0: 1.5 */
    float ior_outside;           /* 0: 1 */
    float absorption[3];         /* inside, 1/m */
    float absorption_outside[3]; /* 1/m */
    float metallic;              /* 0 to 1 */
    float specular;              /* strength of the dielectric reflection, 0 to 1 */
    float specular_color[3];     /* of the dielectric reflection at normal incidence */
    float transmission;          /* share of the dielectric base that transmits, 0 to 1 */
    uint32_t solid;              /* transmission enters 1: a solid, 0: a thin sheet */
    float emission[3];           /* radiance, W/(m^2 sr), from the front */
    uint32_t emission_two_sided; /* 1: from the back too */
    float walked_roughness;      /* rough refraction below this roughness is crossed by manifold walks where
                                    caustic connections are made and no light is a point, a spot or
                                    directional; 0 to 1; 0: smooth refraction alone */
    /* Textures; those of id 0 are none. They show on meshes with texture coordinates; elsewhere they are left
     * out, with a warning of the commit. */
    caustica_texture color_texture;              /* multiplies color; the product is at most 1 */
    caustica_texture metallic_roughness_texture; /* glTF, where transmission is 0: green multiplies roughness,
                                                    blue metallic; what roughness leaves rough is never quite
                                                    a mirror: 0.032 at least */
    caustica_texture emission_texture;           /* multiplies emission; what has no texture coordinates emits nothing */
    caustica_texture normal_texture;             /* of the shading normal, where nothing refracts: twice the texel
                                                    less 1 is its part to the right in the image, upward in it, and
                                                    along the mesh's normal; LINEAR8 or FLOAT, not SRGB8 */
    float normal_scale;                          /* of the first two; 0: 1 */
    uint32_t reserved;
    float texture_transform[6];                  /* two rows of three: (u', v') = M (u, v, 1) finds the texels of
                                                    all four; all 0: the identity */
    float abbe_number;          /* dispersion: V_d = (n_d - 1) / (n_F - n_C), 20 to 95 for glasses, 1 to 1e6, `ior` being
                                   n_d; 0: the index is the same for all light. Of no effect in thin sheets */
    float abbe_number_outside;  /* dielectric: of the medium outside */
} caustica_material_desc;

/* Fills a descriptor, whose struct_size is set, with a model's defaults: white, smooth, index 1.5, no
 * absorption, no emission; for the glTF model those of glTF (metallic 1, roughness 1). In a descriptor
 * that was zeroed instead, colours and specular are 0, which is black. */
caustica_result caustica_material_desc_init(caustica_material_desc* desc, uint32_t model);

caustica_result caustica_material_create(caustica_device* device, const caustica_material_desc* desc,
                                         caustica_material* material);

/* Replaces all values, also for instances that have the material already. */
caustica_result caustica_material_set(caustica_device* device, caustica_material material,
                                      const caustica_material_desc* desc);

caustica_result caustica_material_release(caustica_device* device, caustica_material material);

/* ---- Scenes --------------------------------------------------------------------------------- */

caustica_result caustica_scene_create(caustica_device* device, caustica_scene* scene);

/* Ends a scene with its instances, lights and cameras. Running renders keep their snapshots. */
caustica_result caustica_scene_release(caustica_device* device, caustica_scene scene);

/* Adds all that the default scene of a .gltf or .glb file holds. Its environment, if it has one, replaces the scene's. What
 * the file asks for and is not rendered comes as warnings, whose number goes to `warning_count`, which
 * may be NULL. The added instances and lights have no handles; cameras do, see caustica_scene_camera. */
caustica_result caustica_scene_load(caustica_device* device, caustica_scene scene, const char* path,
                                    uint32_t* warning_count);

/* Radiance that arrives from infinity, the same from everywhere, in place of any image; at first 0. */
caustica_result caustica_scene_set_environment(caustica_device* device, caustica_scene scene, const float radiance[3]);

/* An image of what is infinitely far away, latitude by longitude: the top row is around +y, the middle of the image +z,
 * its left quarter +x, turned as OpenEXR's environment maps are. Between the centres of its pixels it is interpolated.
 * Numbers below 0 count as 0; others must be finite. An EXR file must fill its display window, and be no cube map. */
typedef struct caustica_environment_desc {
    uint32_t struct_size;
    uint32_t width;        /* columns of `pixels`, up to 65536; else 0 */
    uint32_t height;       /* rows of `pixels`, up to 65536; else 0 */
    float radiance[3];     /* what the image is multiplied by, W/(m^2 sr) if it is relative to 1 */
    const float* pixels;   /* r, g, b, linear Rec. 709, row by row from the top; or NULL */
    uint64_t pixel_stride; /* bytes from one to the next; 0: 12 */
    const char* path;      /* an image file in place of `pixels`: .exr, .hdr and so on as in caustica_render_write; or NULL */
    double transform[12];  /* image to world, a rotation whose translation is ignored; all 0: the identity */
} caustica_environment_desc;

/* Surrounds a scene with an image, copied or read during the call. Without `pixels` and `path` the image that was there
 * stays, with another radiance and transform; CAUSTICA_ERROR_WRONG_STATE if there is none. */
caustica_result caustica_scene_set_environment_image(caustica_device* device, caustica_scene scene,
                                                     const caustica_environment_desc* desc);

/* Shows a mesh in a scene, as often as wanted. A mirroring transform keeps the front the front.
 * `instance` may be NULL. */
caustica_result caustica_scene_add_mesh(caustica_device* device, caustica_scene scene, caustica_mesh mesh,
                                        caustica_material material, const double transform[12], const char* name,
                                        caustica_instance* instance);

/* Shows an analytic sphere about the origin of the transform, which may scale it uniformly only.
 * `instance` may be NULL. */
caustica_result caustica_scene_add_sphere(caustica_device* device, caustica_scene scene, double radius,
                                          caustica_material material, const double transform[12], const char* name,
                                          caustica_instance* instance);

caustica_result caustica_instance_set_transform(caustica_device* device, caustica_instance instance,
                                                const double transform[12]);

caustica_result caustica_instance_set_material(caustica_device* device, caustica_instance instance,
                                               caustica_material material);

/* 0: from the next commit on it is as if it were not there; 1: it is there again. */
caustica_result caustica_instance_set_visible(caustica_device* device, caustica_instance instance, uint32_t visible);

/* Takes it out of its scene; the handle ends. */
caustica_result caustica_instance_remove(caustica_device* device, caustica_instance instance);

/* What a snapshot is built for. It decides on times alone; where a ray hits two triangles at once, at an edge, either may
 * count. */
enum {
    CAUSTICA_BUILD_STATIC = 1,  /* fast renders: the default. A change of geometry builds all of it again */
    CAUSTICA_BUILD_EDITABLE = 2 /* fast commits: large meshes are built one by one, and kept while they stay where they
                                   are. Renders take up to about a quarter longer, most where many meshes overlap. Embree's
                                   alone: obvhs builds all again */
};

/* From the next commit on. */
caustica_result caustica_scene_set_build(caustica_device* device, caustica_scene scene, uint32_t build);

typedef struct caustica_commit_report {
    uint32_t struct_size;
    uint32_t warning_count;  /* each was a message, of this commit or of an earlier one */
    uint64_t triangle_count; /* in world space: of every instance */
    uint64_t scene_hash;     /* equal for equal scenes */
    double seconds;
    double center[3];        /* of a sphere around all instances; without any, 0 */
    double radius;           /* of that sphere; without any, 1 */
} caustica_commit_report;

/* Checks the scene, builds, and makes the snapshot that later renders use; an empty scene, too. An instance that its
 * transform scales to nothing or flattens is left out, with a warning. It is here that the values of
 * meshes, materials, instances, lights and cameras are checked. On an error the last snapshot stays, and
 * the details name object, field, index and value. `report` may be NULL. Where meshes and instances are as
 * they were and where they were, geometry is not built again: a change of cameras, lights and materials commits
 * fast. For changes of geometry, see caustica_scene_set_build. */
caustica_result caustica_scene_commit(caustica_device* device, caustica_scene scene, caustica_commit_report* report);

/* ---- Lights --------------------------------------------------------------------------------- */

/* Lights without a surface; surfaces emit by their material. No camera path hits these: of their light, what crosses
 * glass or a mirror on every leg to the camera is found by caustic connections alone, or not at all. A commit says so
 * in messages of CAUSTICA_SEVERITY_INFO where it matters. A small emissive sphere or rectangle has no such limit. */
enum {
    CAUSTICA_LIGHT_POINT = 1,      /* uses position */
    CAUSTICA_LIGHT_SPOT = 2,       /* uses position, direction, inner_angle, outer_angle */
    CAUSTICA_LIGHT_DIRECTIONAL = 3 /* uses direction */
};

typedef struct caustica_light_desc {
    uint32_t struct_size;
    uint32_t kind;       /* CAUSTICA_LIGHT_, required */
    const char* name;    /* for messages */
    double position[3];  /* world space */
    double direction[3]; /* the way the light travels, any length but 0 */
    double inner_angle;  /* half-angle of full intensity */
    double outer_angle;  /* half-angle of no intensity: inner_angle or more, 1e-6 to pi/2 */
    float intensity[3];  /* point, spot: W/sr; directional: irradiance perpendicular to it, W/m^2 */
    uint32_t reserved;
} caustica_light_desc;

/* Puts a light into a scene. `light` may be NULL. */
caustica_result caustica_scene_add_light(caustica_device* device, caustica_scene scene,
                                         const caustica_light_desc* desc, caustica_light* light);

/* Replaces all values. */
caustica_result caustica_light_set(caustica_device* device, caustica_light light, const caustica_light_desc* desc);

/* Takes it out of its scene; the handle ends. */
caustica_result caustica_light_remove(caustica_device* device, caustica_light light);

/* ---- Cameras -------------------------------------------------------------------------------- */

enum { CAUSTICA_CAMERA_PERSPECTIVE = 1, CAUSTICA_CAMERA_ORTHOGRAPHIC = 2 };

/* Looks along -z of its own space, y up. The aspect ratio is that of the image. */
typedef struct caustica_camera_desc {
    uint32_t struct_size;
    uint32_t projection;  /* CAUSTICA_CAMERA_, required */
    const char* name;     /* for messages */
    double transform[12]; /* camera to world, scaling is ignored; all 0: the identity */
    double yfov;          /* perspective: full vertical field of view, 1e-6 to pi - 1e-6 */
    double ymag;          /* orthographic: half the height of the film, metres */
    double lens_radius;   /* perspective: of a thin round lens, metres; 0: a pinhole, all is sharp */
    double focus_distance; /* with a lens: depth of what is sharp, along the direction of view, metres; 1e-3 radii at least */
    double shift[2];      /* by how much the film is moved to the right and up, in heights of the picture; +-1000 at most */
} caustica_camera_desc;

/* Puts a camera into a scene. `camera` may be NULL. */
caustica_result caustica_scene_add_camera(caustica_device* device, caustica_scene scene,
                                          const caustica_camera_desc* desc, caustica_camera* camera);

/* The number of cameras, those of loaded files included. */
caustica_result caustica_scene_camera_count(caustica_device* device, caustica_scene scene, uint64_t* count);

/* The camera at a place in the order in which they were added. */
caustica_result caustica_scene_camera(caustica_device* device, caustica_scene scene, uint64_t index,
                                      caustica_camera* camera);

/* Replaces all values, the name unless it is NULL or empty. */
caustica_result caustica_camera_set(caustica_device* device, caustica_camera camera, const caustica_camera_desc* desc);

/* Its values, as they are since the last change, committed or not; of a loaded file's, too. `name` becomes NULL. */
caustica_result caustica_camera_get(caustica_device* device, caustica_camera camera, caustica_camera_desc* desc);

/* Takes it out of its scene; the handle ends. */
caustica_result caustica_camera_remove(caustica_device* device, caustica_camera camera);

/* ---- Renders -------------------------------------------------------------------------------- */

enum {
    CAUSTICA_INTEGRATOR_DEFAULT = 0, /* as CAUSTICA_INTEGRATOR_BDPT or _BDPT_PLAIN: a few samples decide whether
                                        the connections pay; with point, spot and directional lights BDPT */
    CAUSTICA_INTEGRATOR_PATH = 1,    /* path tracing with next-event estimation */
    CAUSTICA_INTEGRATOR_BDPT = 2,    /* bidirectional path tracing with caustic connections */
    CAUSTICA_INTEGRATOR_MNEE = 3,    /* path tracing with manifold next-event estimation */
    CAUSTICA_INTEGRATOR_BDPT_PLAIN = 4, /* bidirectional path tracing without caustic connections */
    CAUSTICA_INTEGRATOR_LIGHT = 5    /* light tracing; what the camera sees through glass or in mirrors is black */
};

enum {
    CAUSTICA_STATE_RUNNING = 1,
    CAUSTICA_STATE_DONE = 2,
    CAUSTICA_STATE_CANCELLED = 3, /* the passes that were whole make the image */
    CAUSTICA_STATE_FAILED = 4     /* no result; caustica_render_read still gives the passes that were whole */
};

typedef struct caustica_progress {
    uint32_t struct_size;
    uint32_t state;    /* CAUSTICA_STATE_ */
    float fraction;    /* 0 to 1, never falling; 1 only at success */
    uint32_t samples;  /* whole passes: samples per pixel so far */
    uint64_t rays;     /* traced so far */
    double elapsed_seconds;
    float noise;       /* estimated relative standard error of the image, as of the last pass that was one to estimate
                          after, like all powers of two; NaN before the second */
    uint32_t reserved;
    caustica_render_job render; /* whose it is; with caustica_render valid during its callback, too */
} caustica_progress;

/* Called from a thread of the render, one at a time, at most ten times a second, first with fraction 0
 * and last with 1 if the render succeeds. Returns whether to go on: false cancels. That thread does not render
 * meanwhile; with caustica_render it may be the caller's. It may read the image. `progress` is valid during the call.
 * Not called any more once a wait or caustica_render has returned. */
typedef bool (*caustica_progress_callback)(void* user, const caustica_progress* progress);

/* Called once, however a render ends, with its result: on its thread, after the last progress, when its image can be read,
 * and before a wait for it or caustica_render returns, but perhaps before caustica_render_start does. */
typedef void (*caustica_done_callback)(void* user, caustica_render_job render, caustica_result result);

enum {
    CAUSTICA_GEOMETRY_TERM_EXACT = 0, /* generalised: weights fall where light gathers */
    CAUSTICA_GEOMETRY_TERM_DIRECT = 1 /* as if nothing were between the ends, as in the paper */
};

enum {
    CAUSTICA_CHECK_EXACT = 0, /* by the connection's own walk */
    CAUSTICA_CHECK_FEW = 1,   /* by its first three steps, as in the paper; biased, needs the direct geometry term */
    CAUSTICA_CHECK_OFF = 2    /* not at all; biased, needs the direct geometry term */
};

enum {
    CAUSTICA_ROULETTE_CONTRIBUTION = 0, /* by what a connection is expected to bring */
    CAUSTICA_ROULETTE_LENGTHS = 1,      /* by the lengths of both subpaths, as in the paper */
    CAUSTICA_ROULETTE_OFF = 2           /* all connections are tried */
};

/* How connections through glass are made: what `caustica render --help` has under the same names. Zero is the default
 * in every field. Light tracing looks at aim alone, path tracing at nothing here. The paper's settings are
 * CAUSTICA_INTEGRATOR_BDPT with the direct geometry term, the check of few steps, roulette by lengths, 1 for seeds and
 * light_subpaths and -1 for search and aim. */
typedef struct caustica_caustic_options {
    uint32_t struct_size;
    uint32_t geometry_term;   /* CAUSTICA_GEOMETRY_TERM_: of chains, in the weights */
    uint32_t check;           /* CAUSTICA_CHECK_: how a sampled chain is recognised as one that a connection finds */
    uint32_t roulette;        /* CAUSTICA_ROULETTE_: which connections are tried */
    float roulette_threshold; /* times the mean radiance: what is always tried, of _CONTRIBUTION alone; 0: 0.5 */
    uint32_t seeds;           /* most walks from one pair of ends, 1 to 3; 0: 3 to lights that cannot be hit, through
                                 curved glass for MNEE, and where a few samples forecast that it pays, else 1 */
    float search;             /* probability with which a connection through curved or faceted glass searches for one
                                 more path, up to 1; 0: for BDPT 0.25 to lights that cannot be hit, 0.1 where curved
                                 glass is and it is forecast to pay; less than 0: none. Needs the exact check */
    float aim;                /* share of what light subpaths draw that is aimed at glass, for BDPT and light tracing, up
                                 to 0.95; 0: for BDPT 0.5 where it is forecast to pay; less than 0: none */
    float light_subpaths;     /* of BDPT per sample, 0.001 to 64; 0: 1, or fewer where it is forecast to pay */
    uint32_t walk_iterations; /* most steps of a walk, at most 4096; 0: 64 to lights that cannot be hit, else 24 */
    double walk_tolerance;    /* largest deviation from Snell's law, radians, 1e-13 to 1e-5; 0: 1e-8 */
} caustica_caustic_options;

typedef struct caustica_region {
    uint32_t x; /* columns left of it */
    uint32_t y; /* rows above it */
    uint32_t width;
    uint32_t height;
} caustica_region;

typedef struct caustica_render_desc {
    uint32_t struct_size;
    uint32_t integrator;    /* CAUSTICA_INTEGRATOR_ */
    caustica_scene scene;   /* its last commit is rendered */
    caustica_camera camera; /* one that was in it at the commit; id 0: the first */
    uint32_t width;         /* pixels, at most 65536; 0 in both: 512 */
    uint32_t height;        /* pixels */
    uint32_t samples;       /* per pixel; 0: 64, with a time limit as many as fit, with a noise limit at most 65536 */
    uint32_t max_depth;     /* segments of the longest path, 1 is light seen directly, at most 1024; 0: 12 */
    uint64_t seed;          /* selects the random numbers; the image depends on it and not on threads, but on the
                               make of processor in the last place of what Embree hits */
    double time_limit_seconds; /* ends with the pass that runs at this time; 0: no limit. The samples before the first
                                  pass, which decide on caustics, are drawn in any case: up to some seconds of a
                                  thread */
    uint32_t num_threads;   /* 0: the device's */
    uint32_t caustics_only; /* 1: all light is left out but what mirrors and smooth glass lead to the surface that the
                               camera sees, and rough glass where it is crossed by walks; else 0 */
    caustica_progress_callback progress; /* or NULL */
    void* user;             /* of progress and done */
    const caustica_caustic_options* caustic_options; /* read during the call; or NULL: all defaults */
    float noise_limit;      /* ends after the pass that brings caustica_progress::noise down to this, after 16 passes at
                               least; 0: no limit. The number of passes is the same for any number of threads */
    uint32_t first_sample;  /* number of the first; the average of renders of samples 0 to 63 and 64 to 127 is the image of
                               samples 0 to 127 */
    caustica_region region; /* what of the width x height pixels is rendered, and is the image, of which EXR and TIFF files say
                               where it is; all 0: all of them. CAUSTICA_INTEGRATOR_PATH gives the bits of the whole; with
                               the others, light subpaths are as many as the region's samples, and forecasts are the
                               region's: put together, parts have the right light and may differ in their noise, and with
                               `clamp` in what that takes */
    uint32_t features;      /* 1: what the samples see is kept for caustica_render_read, CAUSTICA_IMAGE_ALBEDO, _NORMAL and
                               _DEPTH; else
                               0. Not by CAUSTICA_INTEGRATOR_LIGHT */
    float clamp;            /* most radiance that one path may add to a pixel, in its largest channel, unless the camera sees
                               the light itself, by mirrors or through smooth glass: less noise for a bias, of which
                               caustica_statistics::clamped tells; 0: no limit */
    uint32_t transparent;   /* 1: what the camera sees of the environment with nothing before it is left out, and alpha says
                               where, for a background of the host's; what glass and mirrors show of it stays; else 0. Not by
                               CAUSTICA_INTEGRATOR_LIGHT */
    uint32_t reserved;
    const caustica_camera_desc* camera_desc; /* read during the call: in place of `camera`, and need not be in the scene, so
                               that another view takes no commit; or NULL */
    caustica_done_callback done; /* or NULL */
} caustica_render_desc;

/* Renders, and returns when it is over: CAUSTICA_OK, or CAUSTICA_CANCELLED when the callback asked for
 * it. In both cases `render` is written and is to be released; it holds the image, unless it was cancelled before the
 * first pass. */
caustica_result caustica_render(caustica_device* device, const caustica_render_desc* desc, caustica_render_job* render);

/* Viewports: an image is shown soonest if a small one, of a few thousand pixels, comes before the whole, by
 * CAUSTICA_INTEGRATOR_PATH or _BDPT_PLAIN, since the others draw samples before their first pass, some tenths of a second
 * of a thread. Views go by `camera_desc`, without a commit. For the next edit, cancel, change, commit and start again: the render that was cancelled ends by itself,
 * in milliseconds, and can be released later. A scene's commit may run on a thread of its own, while it is changed.
 *
 * Starts a render and returns at once. What is wrong with the request is told here, a later failure by
 * caustica_render_result. */
caustica_result caustica_render_start(caustica_device* device, const caustica_render_desc* desc,
                                      caustica_render_job* render);

/* How far it is. Callback-safe. */
caustica_result caustica_render_poll(caustica_device* device, caustica_render_job render, caustica_progress* progress);

/* Waits until it is over, however it ends, or for `timeout_seconds`: then CAUSTICA_TIMEOUT. Less than 0
 * waits for ever. After CAUSTICA_OK, its threads are gone and nothing of the host's is touched. */
caustica_result caustica_render_wait(caustica_device* device, caustica_render_job render, double timeout_seconds);

/* Asks it to stop, and does not wait. May be repeated. Callback-safe. */
caustica_result caustica_render_cancel(caustica_device* device, caustica_render_job render);

typedef struct caustica_statistics {
    uint32_t struct_size;
    uint32_t width;             /* of the image */
    uint32_t height;
    uint32_t samples;           /* per pixel, in the image */
    uint64_t camera_rays;       /* nearest-hit rays from the camera */
    uint64_t camera_path_rays;  /* nearest-hit rays that continue camera subpaths */
    uint64_t light_path_rays;   /* nearest-hit rays of light subpaths */
    uint64_t shadow_rays;       /* visibility rays */
    uint64_t walk_rays;         /* rays of manifold walks */
    uint64_t connection_walks;  /* manifold walks tried to connect through glass */
    uint64_t connected_walks;   /* of these, those that found a free chain */
    uint64_t check_walks;       /* manifold walks to check sampled chains */
    uint64_t confirmed_walks;   /* of these, those that found the chain */
    uint64_t walk_iterations;   /* steps of all walks */
    uint64_t spared_walks;      /* walks that roulette spared */
    float forecast_variance;    /* caustics' variance without caustic connections over that with them, per sample; what
                                   would be found much more seldom counts up to 16 times */
    float forecast_work;        /* work with them over that without, per sample; both NaN if not forecast */
    uint64_t non_finite;        /* samples that were NaN or infinite, dropped from the image */
    uint32_t first_non_finite_pixel;  /* row * width + column; UINT32_MAX if there is none */
    uint32_t first_non_finite_sample; /* UINT32_MAX if there is none */
    double commit_seconds;      /* of the snapshot */
    double render_seconds;
    uint64_t scene_bytes;       /* geometry, acceleration structure and images */
    uint64_t film_bytes;
    uint32_t threads;
    float noise;                /* estimated relative standard error; NaN if unknown */
    float clamped;              /* share of the light that `clamp` has taken */
    uint32_t caustics;          /* 1 if caustic connections were made, else 0 */
    uint32_t aimed;             /* 1 if light subpaths were aimed at glass, else 0 */
    float aim_forecast_variance; /* caustics' variance without aim over that with it, per sample */
    float aim_forecast_work;    /* work with aim over that without, per sample; both NaN if not forecast */
    float light_subpaths;       /* per sample */
    uint32_t seeds;             /* most walks from one pair of ends, to lights that can be hit; 0 without connections */
    float search;               /* probability with which a connection searched for one more path, likewise; 0: never */
    float seeds_forecast_variance; /* caustics' variance with one walk from a pair of ends over that with more */
    float seeds_forecast_work;  /* work with more over that with one, per sample; both NaN if not forecast */
    float search_forecast_variance; /* caustics' variance without searches over that with them, per sample */
    float search_forecast_work; /* work with them over that without, per sample; both NaN if not forecast */
    char backend[64];           /* the ray tracer */
} caustica_statistics;

/* How it ended: CAUSTICA_OK, CAUSTICA_CANCELLED, or the error it failed with, whose details are then this
 * thread's last error. CAUSTICA_ERROR_WRONG_STATE while it runs. `statistics` may be NULL; they are
 * written unless it failed. Callback-safe. */
caustica_result caustica_render_result(caustica_device* device, caustica_render_job render,
                                       caustica_statistics* statistics);

enum {
    CAUSTICA_FORMAT_RGB_F32 = 1, /* linear Rec. 709; of normals x, y, z */
    CAUSTICA_FORMAT_RGBA_F32 = 2 /* the same, and the share of the pixel that something covers, by which r, g, b are
                                    multiplied already: of a `transparent` render; else, and of other images, 1 */
};

enum {
    CAUSTICA_IMAGE_RADIANCE = 0,
    /* For denoisers, of renders that were asked for features: colour (0 to 1) and shading normal (world space, on the side
     * that is seen) of the first surface that is not all smooth glass or mirror, seen through those; lamps and the
     * environment have the colour of their light, the environment no normal, and where it is left out (`transparent`) no colour. Averages over the samples of a pixel: normals
     * are shorter than 1 where these differ. While it renders, images that are read one after another may be of different
     * passes: `samples` tells. */
    CAUSTICA_IMAGE_ALBEDO = 1,
    CAUSTICA_IMAGE_NORMAL = 2,
    /* Likewise, for compositors: the distance along the direction of view, metres, of the first surface, also of glass and
     * mirrors; in all channels. The average over those samples of a pixel that meet one; 0 where none does. */
    CAUSTICA_IMAGE_DEPTH = 3
};

typedef struct caustica_pixels {
    uint32_t struct_size;
    uint32_t format;     /* CAUSTICA_FORMAT_, required */
    void* data;          /* any alignment */
    uint64_t size;       /* bytes at `data`; checked */
    uint64_t row_stride; /* bytes from one row to the next; 0: no gap */
    uint32_t* samples;   /* or NULL; written: samples per pixel of the image that is copied */
    uint32_t image;      /* CAUSTICA_IMAGE_ */
    uint32_t reserved;
} caustica_pixels;

/* Copies the image to the host's memory: of a render that is over, or of one that runs the average over its
 * whole passes so far. CAUSTICA_ERROR_WRONG_STATE while there is none, or if the render was cancelled before the
 * first. Callback-safe. */
caustica_result caustica_render_read(caustica_device* device, caustica_render_job render,
                                     const caustica_pixels* pixels);

/* Writes the image of a render that is over to a file, whose format its extension names: .exr (16-bit half, the only one
 * with alpha) is always there; .tif (32-bit float), .hdr, and .png and .jpg (8-bit sRGB, cut at 1) need OpenImageIO. For
 * all bits: caustica_render_read. CAUSTICA_ERROR_WRONG_STATE while it runs, or if it was cancelled before its first
 * whole pass. On an error a file that was there before is as it was. */
caustica_result caustica_render_write(caustica_device* device, caustica_render_job render, const char* path);

/* Gives a render and its image up. One that runs is cancelled and waited for. */
caustica_result caustica_render_release(caustica_device* device, caustica_render_job render);

#ifdef __cplusplus
}
#endif

#endif

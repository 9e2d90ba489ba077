"""A scene of scenes/catalogue.py as a Mitsuba 3 scene. Call `mi.set_variant` before importing."""

import pathlib
import sys

import drjit as dr
import mitsuba as mi
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scenes"))

from model import Diffuse, Sphere, SpotLight  # noqa: E402
import glb  # noqa: E402


class SideChecked(mi.BSDF):
    """Mitsuba's nested BSDF, but zero where the geometric and the shading side of a direction differ.

    Caustica's rule (and Veach's, 1997, section 5.3); Mitsuba's own BSDFs know the shading side only.
    """

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.nested = next(props[name] for name in props.unqueried()
                           if isinstance(props[name], mi.BSDF))
        self.m_components = [self.nested.flags(i) for i in range(self.nested.component_count())]
        self.m_flags = self.nested.flags()

    def agrees(self, si, local):
        return dr.dot(si.n, si.to_world(local)) * mi.Frame3f.cos_theta(local) > 0

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, weight = self.nested.sample(ctx, si, sample1, sample2, active)
        ok = self.agrees(si, si.wi) & self.agrees(si, bs.wo)
        return bs, weight & ok

    def eval(self, ctx, si, wo, active=True):
        ok = self.agrees(si, si.wi) & self.agrees(si, wo)
        return self.nested.eval(ctx, si, wo, active) & ok

    def pdf(self, ctx, si, wo, active=True):
        return self.nested.pdf(ctx, si, wo, active)

    def eval_pdf(self, ctx, si, wo, active=True):
        ok = self.agrees(si, si.wi) & self.agrees(si, wo)
        value, pdf = self.nested.eval_pdf(ctx, si, wo, active)
        return value & ok, pdf

    def traverse(self, cb):
        cb.put("nested", self.nested, mi.ParamFlags.Differentiable)

    def to_string(self):
        return "SideChecked[]"


mi.register_bsdf("sidechecked", lambda props: SideChecked(props))


def rgb(value):
    return {"type": "rgb", "value": list(value)}


def decoded(texture):
    """Linear, for `raw` bitmaps: the transfer function is Caustica's to the last bit but one."""
    code = np.array(texture.rows, np.float64) / 255
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def bitmap(texture, factor=(1.0, 1.0, 1.0)):
    image = (decoded(texture) * factor).astype(np.float32)
    return {"type": "bitmap", "bitmap": mi.Bitmap(image), "raw": True, "filter_type": "bilinear", "wrap_mode": "repeat"}


def bsdf(material, smooth, side_check):
    """Leaves the absorption of tinted glass out: Mitsuba's dielectrics have none."""
    if isinstance(material, Diffuse):
        reflectance = (bitmap(material.texture, material.reflectance) if material.texture
                       else rgb(material.reflectance))
        out = {"type": "twosided", "nested": {"type": "diffuse", "reflectance": reflectance}}
        if smooth and side_check:
            # The side check lets no light through, so the back is never lit in closed meshes.
            out = out["nested"]
    elif material.roughness > 0:
        out = {"type": "roughdielectric", "distribution": "ggx", "alpha": material.roughness**2,
               "int_ior": material.ior, "ext_ior": material.exterior, "sample_visible": True}
    else:
        out = {"type": "dielectric", "int_ior": material.ior, "ext_ior": material.exterior}
        if material.texture:
            out["specular_transmittance"] = bitmap(material.texture)
    if smooth and side_check:
        out = {"type": "sidechecked", "nested": out}
    return out


def mesh(name, shape, props):
    smooth = bool(shape.normals)
    out = mi.Mesh(name, len(shape.positions), len(shape.triangles), has_vertex_normals=smooth,
                  has_vertex_texcoords=bool(shape.coordinates), props=props)
    params = mi.traverse(out)

    def flat(rows):
        return np.array([[glb.rounded(x) for x in row] for row in rows], np.float32).ravel()

    params["vertex_positions"] = flat(shape.positions)
    params["faces"] = np.array(shape.triangles, np.uint32).ravel()
    if smooth:
        params["vertex_normals"] = flat(shape.normals)
    if shape.coordinates:
        params["vertex_texcoords"] = flat(shape.coordinates)
    params.update()
    return out


def environment(scene):
    """The image with more pixels: Mitsuba's lowest and highest rows are at the poles, and it is linear in the angle where
    Caustica is linear in its cosine. Pixels' centres fall onto each other."""
    image = np.array(scene.sky.rows, np.float16).astype(np.float64) * scene.environment
    height, width, _ = image.shape
    columns, rows = 9 * width, 8 * height + 1
    edges = np.cos(np.clip((np.arange(height + 2) - 0.5) / height, 0, 1) * np.pi)
    cosines = np.cos(np.arange(rows) / (rows - 1) * np.pi)
    row = np.clip(np.searchsorted(-edges, -cosines, side="right") - 1, 0, height)
    y = ((edges[row] - cosines) / (edges[row] - edges[row + 1]))[:, None, None]
    top, bottom = np.maximum(row - 1, 0), np.minimum(row, height - 1)
    across = (np.arange(columns) + 0.5) / 9 - 0.5
    left = np.floor(across).astype(int)
    x = (across - left)[None, :, None]
    left, right = left % width, (left + 1) % width
    mixed = image[:, left] * (1 - x) + image[:, right] * x
    return mi.Bitmap((mixed[top] * (1 - y) + mixed[bottom] * y).astype(np.float32))


def convert(scene, size, integrator, side_check=True, replace=None):
    """`replace` maps a material to another, or keeps it."""
    out = {"type": "scene", "integrator": integrator}
    for thing in scene.objects:
        shape, material = thing.shape, thing.material
        material = replace(material) if replace else material
        smooth = not isinstance(shape, Sphere) and bool(shape.normals)
        children = {"bsdf": bsdf(material, smooth, side_check)}
        emission = getattr(material, "emission", (0.0,))
        if any(emission):
            children["emitter"] = {"type": "area", "radiance": rgb(emission)}
        key = thing.name.replace(" ", "_")
        if isinstance(shape, Sphere):
            out[key] = {"type": "sphere", "center": list(shape.center), "radius": shape.radius,
                        **children}
        else:
            props = mi.Properties()
            for child, value in children.items():
                props[child] = mi.load_dict(value)
            if not smooth:
                props["face_normals"] = True
            out[key] = mesh(key, shape, props)
    for light in scene.lights:
        if isinstance(light, SpotLight):
            # Between the two angles the falloff is not glTF's.
            out[light.name] = {"type": "spot", "intensity": rgb(light.intensity),
                               "beam_width": light.inner, "cutoff_angle": light.outer,
                               "to_world": mi.ScalarTransform4f().look_at(
                                   list(light.position), list(light.target), [0, 1, 0])}
        else:
            out[light.name] = {"type": "point", "position": list(light.position),
                               "intensity": rgb(light.intensity)}
    if scene.sky:
        out["environment"] = {"type": "envmap", "bitmap": environment(scene), "to_world":
                              mi.ScalarTransform4f().rotate([0, 1, 0], scene.turn)}
    elif any(scene.environment):
        out["environment"] = {"type": "constant", "radiance": rgb(scene.environment)}
    camera = scene.camera
    out["sensor"] = {
        "type": "perspective", "fov": camera.yfov, "fov_axis": "y", "near_clip": 0.001,
        "to_world": mi.ScalarTransform4f().look_at(list(camera.origin), list(camera.target),
                                                   list(camera.up)),
        "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"},
                 "pixel_format": "rgb", "component_format": "float32"},
        "sampler": {"type": "independent"},
    }
    return mi.load_dict(out)

#!/usr/bin/env python3
"""Checks with Mitsuba what scenes/README.md says of path classes.

Each claim is that an image is exactly black once one kind of surface is made black, or what the camera sees first.
"""

import sys

sys.dont_write_bytecode = True
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
from convert import convert  # noqa: E402  needs the variant; also puts scenes/ on the path
import catalogue  # noqa: E402
from dataclasses import replace  # noqa: E402
from model import Camera, Diffuse, Glass  # noqa: E402

BLACK = Diffuse("black", (0.0, 0.0, 0.0))


def black_panel(material):
    return BLACK if material.name == "panel" else material


def black_wall(material):
    return BLACK if material.name == "wall" else material


def black_glass(material):
    return BLACK if isinstance(material, Glass) else material


def black_diffuse(material):
    return replace(material, reflectance=BLACK.reflectance) if isinstance(material, Diffuse) else material


def brightest(scene, change, integrator) -> float:
    converted = convert(scene, 64, {"type": integrator, "max_depth": 16, "rr_depth": 1000},
                        replace=change)
    return float(np.max(np.array(mi.render(converted, spp=256))))


def first_hits(scene) -> set[str]:
    """Names of what the camera sees without glass between."""
    converted = convert(scene, 64, {"type": "path"})
    grid = (mi.Float(np.repeat(np.arange(512), 512)), mi.Float(np.tile(np.arange(512), 512)))
    film = mi.Point2f((grid[0] + 0.5) / 512, (grid[1] + 0.5) / 512)
    ray, _ = converted.sensors()[0].sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
    hit = converted.ray_intersect(ray)
    seen = set()
    for shape in converted.shapes():
        if np.any(np.array(hit.shape == mi.ShapePtr(shape))):
            seen.add(shape.id())
    return seen


def main() -> int:
    wrong = 0
    for scene in catalogue.scenes():
        figure = scene.name.split("_")[0]
        changes = {"figure4a": [black_panel], "figure4b": [black_glass],
                   "figure4c": [black_glass, black_diffuse],
                   "eye": [black_wall], "pane": [black_glass]}.get(figure, [])
        for change in changes:
            for integrator in ("path", "ptracer"):
                value = brightest(scene, change, integrator)
                print(f"{scene.name}: {change.__name__}, {integrator}: brightest pixel {value}")
                wrong += value != 0.0
        if figure == "window":
            for target in ((0, 1.2, 0), (0, 1.2, -3), (1, 1.2, -1.7), (-1, 1.2, -1.7), (0, 0, -2), (0, 2.4, -2)):
                within = replace(scene, camera=Camera((0, 1.5, -1.0), target, 100.0))
                value = brightest(within, black_glass, "path")
                print(f"{scene.name}: within, black_glass: brightest pixel {value}")
                wrong += value != 0.0
        allowed = {"figure4c": {"plate", "hemisphere", "torch_lens", "torch_tube", "torch_back"},
                   "eye": {"cornea", "sclera"}, "window": {"front_wall", "pane"},
                   "pane": {"pane"}}.get(figure)
        if allowed:
            seen = first_hits(scene)
            print(f"{scene.name}: the camera sees directly: {', '.join(sorted(seen))}")
            wrong += not seen <= allowed
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

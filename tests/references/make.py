#!/usr/bin/env python3
"""Renders the reference images of this folder with Mitsuba 3. README.md says with which versions.

  python3 tests/references/make.py [NAME...]       render and write
  python3 tests/references/make.py --cross [NAME...]  compare with Mitsuba's light tracer
"""

import json
import pathlib
import sys
import time

sys.dont_write_bytecode = True
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
from convert import convert  # noqa: E402  needs the variant; also puts scenes/ on the path
import catalogue  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
SIZE = 64
# Scene: longest path in segments, samples per pixel and run, independent runs.
REFERENCES = {"cornell": (8, 768, 64), "rough_glass": (12, 512, 64), "smooth_normals": (5, 512, 64),
              "figure4a_large": (10, 512, 400), "sky": (7, 512, 200),
              "stained_glass_large": (9, 512, 400)}


def render(name: str, integrator: str, depth: int, spp: int, runs: int, side_check=True):
    """Mean, its standard error per value, and those of the image mean, from independent runs."""
    description = next(s for s in catalogue.scenes() if s.name == name)
    scene = convert(description, SIZE, {"type": integrator, "max_depth": depth, "rr_depth": 1000},
                    side_check)
    images = np.stack([np.array(mi.render(scene, spp=spp, seed=seed), np.float64)
                       for seed in range(1, runs + 1)])
    assert np.isfinite(images).all()
    means = images.mean(axis=(1, 2))
    return (images.mean(axis=0), images.std(axis=0, ddof=1) / runs**0.5,
            means.mean(axis=0), means.std(axis=0, ddof=1) / runs**0.5)


def write(path: pathlib.Path, values) -> None:
    bitmap = mi.Bitmap(values.astype(np.float32), mi.Bitmap.PixelFormat.RGB)
    bitmap.write(str(path))


def make(names) -> None:
    index = HERE / "references.json"
    table = json.loads(index.read_text()) if index.is_file() else {}
    for name in names:
        depth, spp, runs = REFERENCES[name]
        start = time.time()
        image, error, mean, mean_error = render(name, "path", depth, spp, runs)
        write(HERE / f"{name}.exr", image)
        write(HERE / f"{name}_stderr.exr", error)
        table[name] = {"size": SIZE, "max_depth": depth, "runs": runs, "spp_per_run": spp,
                       "mean": [float(f"{x:.8g}") for x in mean],
                       "mean_stderr": [float(f"{x:.3g}") for x in mean_error]}
        print(name, mean, mean_error / mean, f"{time.time() - start:.0f} s", flush=True)
        index.write_text(json.dumps(dict(sorted(table.items())), indent=1) + "\n")


def cross(names) -> None:
    """z-scores of the light tracer's image means and pixels against the stored reference."""
    for name in names:
        depth, spp, runs = REFERENCES[name]
        image, error, mean, mean_error = render(name, "ptracer", depth, spp, runs)
        stored = json.loads((HERE / "references.json").read_text())[name]
        reference = np.array(mi.Bitmap(str(HERE / f"{name}.exr")), np.float64)
        sigma = np.hypot(error, np.array(mi.Bitmap(str(HERE / f"{name}_stderr.exr")), np.float64))
        known = (reference > 0) & (error > 0)
        z = (image - reference)[known] / sigma[known]
        spread = np.hypot(mean_error, stored["mean_stderr"])
        difference = mean - np.array(stored["mean"])
        print(name, "relative difference of means", difference / mean, "z", difference / spread,
              "pixel z: mean", z.mean(), "variance", z.var(), flush=True)


def main() -> None:
    names = [a for a in sys.argv[1:] if a != "--cross"]
    if "--cross" in sys.argv:
        cross(names or [n for n in REFERENCES if n != "figure4a_large"])
    else:
        make(names or REFERENCES)


if __name__ == "__main__":
    main()

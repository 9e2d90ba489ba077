#!/usr/bin/env python3
"""Writes the .glb and .exr files of this folder. Standard library only.

  python3 scenes/generate.py           write them
  python3 scenes/generate.py --check   fail unless the files on disk are what would be written
"""

import pathlib
import sys

import catalogue
import exr
import glb

HERE = pathlib.Path(__file__).resolve().parent


def main() -> int:
    check = sys.argv[1:] == ["--check"]
    if sys.argv[1:] and not check:
        print(__doc__, file=sys.stderr)
        return 2
    wrong, files = [], {}
    for scene in catalogue.scenes():
        files[f"{scene.name}.glb"] = glb.encode(scene)
        if scene.sky:
            files[f"{scene.sky.name}.exr"] = exr.encode(len(scene.sky.rows[0]), scene.sky.rows)
    for name, data in files.items():
        path = HERE / name
        if not check:
            path.write_bytes(data)
        elif not path.is_file() or path.read_bytes() != data:
            wrong.append(path.name)
    if check:
        wrong += sorted(p.name for p in HERE.iterdir() if p.suffix in (".glb", ".exr") and p.name not in files)
    for name in wrong:
        print(f"{name}: differs from what generate.py makes", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Writes the .glb files of this folder. Standard library only.

  python3 scenes/generate.py           write them
  python3 scenes/generate.py --check   fail unless the files on disk are what would be written
"""

import pathlib
import sys

import catalogue
import glb

HERE = pathlib.Path(__file__).resolve().parent


def main() -> int:
    check = sys.argv[1:] == ["--check"]
    if sys.argv[1:] and not check:
        print(__doc__, file=sys.stderr)
        return 2
    wrong, scenes = [], catalogue.scenes()
    for scene in scenes:
        path, data = HERE / f"{scene.name}.glb", glb.encode(scene)
        if not check:
            path.write_bytes(data)
        elif not path.is_file() or path.read_bytes() != data:
            wrong.append(path.name)
    known = {f"{scene.name}.glb" for scene in scenes}
    if check:
        wrong += sorted(p.name for p in HERE.glob("*.glb") if p.name not in known)
    for name in wrong:
        print(f"{name}: differs from what generate.py makes", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

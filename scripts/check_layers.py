#!/usr/bin/env python3
"""Reads the includes of every source file and fails on a breach of the layers, with file and line.

core <- cameras <- { scenes, trajectories, dataset } <- { render | recon | validate } <- studies <- apps, python
"""
import pathlib
import re
import sys

MAY_INCLUDE = {
    "core": set(),
    "cameras": {"core"},
    "scenes": {"core", "cameras"},
    "trajectories": {"core", "cameras"},
    "dataset": {"core", "cameras"},
    "render": {"core", "cameras", "scenes", "trajectories", "dataset"},
    # Reconstruction sees what a real capsule gives: neither the stomach nor the path that made the frames.
    "recon": {"core", "cameras", "dataset"},
    "validate": {"core", "cameras", "dataset"},
}
EVERYTHING_BELOW = {"core", "cameras", "scenes", "trajectories", "dataset", "render", "recon", "validate"}
MAY_INCLUDE["studies"] = EVERYTHING_BELOW
MAY_INCLUDE["apps"] = MAY_INCLUDE["python"] = EVERYTHING_BELOW | {"studies"}

# Headers of observations, estimates and images in memory; the rest of dataset/ knows the truth.
RECON_MAY_SEE = {"dataset/observations.h", "dataset/estimate.h", "dataset/image_io.h", "dataset/colours.h"}
EMBREE_ONLY_IN = {"render/raycaster.cpp", "render/raycaster.h", "render/hierarchy.cpp", "render/hierarchy.h"}

INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')


def breaches(root):
    folders = set(MAY_INCLUDE)
    for folder in sorted(folders):
        for file in sorted((root / folder).rglob("*")):
            if file.suffix not in {".h", ".cpp"}:
                continue
            name = file.relative_to(root).as_posix()
            for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
                match = INCLUDE.match(line)
                if not match:
                    continue
                header = match.group(1)
                target = header.split("/")[0]
                if header.startswith("embree") and name not in EMBREE_ONLY_IN:
                    yield f"{name}:{number}: includes {header}; only render/raycaster and render/hierarchy may"
                if "/" not in header or target not in folders or target == folder:
                    continue
                if target not in MAY_INCLUDE[folder]:
                    yield f"{name}:{number}: {folder} must not include {header}"
                elif folder == "recon" and target == "dataset" and header not in RECON_MAY_SEE:
                    yield f"{name}:{number}: reconstruction must not include {header}: it may know the truth"


def main():
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parent.parent
    found = list(breaches(root))
    for line in found:
        print(line)
    print(f"{len(found)} breaches of the layers")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

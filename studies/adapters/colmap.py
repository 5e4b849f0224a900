#!/usr/bin/env python3
"""COLMAP (Debian package colmap) as a method of a study: incremental mapping of the frames in their order.

studies/adapters/colmap.py FRAMES FRAME_LIST CALIBRATION OUT

    commands: {colmap: [studies/adapters/colmap.py, "{frames}", "{frame_list}", "{calibration}", "{out}"]}
    methods: [paper, colmap]

The calibration is held fixed. Of the models that COLMAP finds the largest counts: its poses go to OUT/trajectory.txt
(TUM, world_from_camera). The sparse points are no wall, so there is no map.
"""

import csv
import os
import subprocess
import sys

OVERLAP = 10  # frames each one is matched to


def camera_of(calibration):
    """COLMAP's model and parameters; both put the centre of the first pixel at (0.5, 0.5)."""
    lens = {}
    with open(calibration, encoding="utf-8") as file:
        for line in file:
            key, colon, value = line.split("#")[0].partition(":")
            if colon:
                lens[key.strip()] = value.strip()
    number = {key: float(lens.get(key, 0)) for key in ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2")}
    if lens["model"] == "kannala_brandt":
        return "OPENCV_FISHEYE", [number[k] for k in ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4")]
    order = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
    return "FULL_OPENCV", [number[k] for k in order] + [0.0, 0.0, 0.0]


def colmap(step, *options):
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    print("colmap", step, *options, flush=True)
    try:
        done = subprocess.run(["colmap", step, *map(str, options)], env=environment)
    except FileNotFoundError:
        sys.exit("colmap is not installed")
    if done.returncode:
        sys.exit(f"colmap {step} ended with {done.returncode}")


def poses_of(images):
    """(name, world_from_camera as x y z qx qy qz qw) of every image; the file has camera_from_world, two lines each."""
    with open(images, encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    for line in lines[::2]:
        word = line.split()
        w, x, y, z = (float(v) for v in word[1:5])
        t = [float(v) for v in word[5:8]]
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        position = [-sum(rows[k][axis] * t[k] for k in range(3)) for axis in range(3)]
        yield word[9], position + [-x, -y, -z, w]


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    frames, frame_list, calibration, out = sys.argv[1:]
    database, models = os.path.join(out, "database.db"), os.path.join(out, "models")
    os.makedirs(models, exist_ok=True)
    model, parameters = camera_of(calibration)
    colmap(
        "feature_extractor", "--database_path", database, "--image_path", frames,
        "--ImageReader.single_camera", 1, "--ImageReader.camera_model", model,
        "--ImageReader.camera_params", ",".join(repr(p) for p in parameters), "--SiftExtraction.use_gpu", 0,
    )  # fmt: skip
    colmap(
        "sequential_matcher", "--database_path", database, "--SequentialMatching.overlap", OVERLAP,
        "--SiftMatching.use_gpu", 0,
    )  # fmt: skip
    colmap(
        "mapper", "--database_path", database, "--image_path", frames, "--output_path", models,
        "--Mapper.ba_refine_focal_length", 0, "--Mapper.ba_refine_principal_point", 0,
        "--Mapper.ba_refine_extra_params", 0,
    )  # fmt: skip

    best = []
    for found in sorted(os.listdir(models)):
        folder = os.path.join(models, found)
        colmap("model_converter", "--input_path", folder, "--output_path", folder, "--output_type", "TXT")
        poses = list(poses_of(os.path.join(folder, "images.txt")))
        if len(poses) > len(best):
            best = poses
    if not best:
        sys.exit("colmap found no model")
    with open(frame_list, encoding="utf-8") as file:
        times = {int(row["index"]): row["time_s"] for row in csv.DictReader(file)}
    lines = []
    for name, pose in best:
        index = int(os.path.splitext(name)[0])
        lines.append((index, " ".join([times[index]] + [repr(v) for v in pose])))
    with open(os.path.join(out, "trajectory.txt"), "w", encoding="utf-8") as file:
        file.write("".join(line + "\n" for _, line in sorted(lines)))


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""How many frames a second the simulator makes, by what it is asked for; what bounds it; its peak memory.

bench/frame_rates.py [--repetitions N] [--frames N] [--noise] [--memory] [--json]

640 x 480 (misumi-v5506), the medium stomach (230k triangles), trajectory 1, files on disk. The settings take turns, medians
are reported. Rates are those of the loop over frames, without making the scene. --noise compares 16 paths a pixel with 256
(root mean square over the pixels of a frame, as a share of the mean). --memory compares the peak memory of 100
frames and of 10000 (the latter takes a quarter of an hour: 250 x 250, every label that is on by default).
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile

BENCH = os.path.dirname(os.path.abspath(__file__))
RUGAE = os.path.join(BENCH, "..", "build", "release", "apps", "rugae")
COLOUR_AND_DEPTH = ["truth.normals=false", "truth.flow=false", "truth.masks=false"]
# name, options, settings, share of the frames
SETTINGS = [
    ("colour and depth", [], COLOUR_AND_DEPTH, 1.0),
    ("colour, depth, normals, flow, masks", [], [], 1.0),
    ("every label", ["--all-labels"], [], 1.0),
    ("colour and depth, 4 samples a pixel", [], COLOUR_AND_DEPTH + ["lens.samples=4"], 0.5),
    ("colour and depth, 2 bounces, 16 paths", [], COLOUR_AND_DEPTH + ["light.bounces=2", "light.samples=16"], 0.05),
]


def run(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"frame_rates: {' '.join(command)} ended with {done.returncode}\n{done.stderr}")
    return done.stdout


def command_for(folder, frames, options, settings, camera="misumi-v5506"):
    shutil.rmtree(folder, ignore_errors=True)
    command = [RUGAE, "simulate", "--camera", camera, "--trajectory", "1", "--frames", str(frames), *options]
    command += ["--set", *settings] if settings else []
    return command + ["--json", "--out", folder]


def rates(arguments, work):
    found = {name: [] for name, *_ in SETTINGS}
    for _ in range(arguments.repetitions):
        for name, options, settings, share in SETTINGS:
            frames = max(2, round(share * arguments.frames))
            found[name].append(json.loads(run(command_for(os.path.join(work, "data"), frames, options, settings))))
    rows = []
    for name, results in found.items():
        stages = {
            stage: statistics.median(1e3 * r["thread_seconds"][stage] / r["frames"] for r in results)
            for stage in results[0]["thread_seconds"]
        }
        rows.append({"what": name, "frames_per_s": statistics.median(r["frames_per_s"] for r in results), "core_ms": stages})
    return rows


def peak_mb(folder, frames):
    """Of a process of its own: the largest resident set, as the kernel counts it."""
    command = command_for(folder, frames, [], [], camera="awaiba-naneye")
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"frame_rates: {' '.join(command)} failed")
    return usage.ru_maxrss / 1024.0


def noise_left(work):
    """Of 2 bounces and 16 paths a pixel: as a share of the light between walls, and of all light."""
    sys.path.insert(0, os.path.join(BENCH, "..", "build", "release", "python"))
    import numpy  # Debian's, as the module is made for its Python
    import rugae

    light = {}
    for paths in (16, 256):
        folder = os.path.join(work, f"paths{paths}")
        settings = ["truth.diffuse=true", "truth.indirect=true", "light.bounces=2", f"light.samples={paths}"]
        run(command_for(folder, 2, [], COLOUR_AND_DEPTH + settings))
        frame = rugae.Dataset(folder)
        light[paths] = frame.label("indirect", 0).astype(float), frame.label("diffuse", 0).astype(float)
    rms = numpy.sqrt(numpy.mean((light[16][0] - light[256][0]) ** 2))
    between = light[256][0].mean()
    return {"of_indirect": rms / between, "of_all": rms / (between + light[256][1].mean())}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument("--noise", action="store_true")
    parser.add_argument("--memory", action="store_true")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        result = {"rates": rates(arguments, work)}
        if arguments.noise:
            result["noise"] = noise_left(work)
        if arguments.memory:
            folder = os.path.join(work, "data")
            result["peak_mb"] = {str(frames): peak_mb(folder, frames) for frames in (100, 10000)}
    if arguments.json:
        print(json.dumps(result, indent=2))
        return
    stages = list(result["rates"][0]["core_ms"])
    print(f"{'':42}{'frames/s':>9}   processor ms a frame: " + " ".join(f"{s:>7}" for s in stages))
    for row in result["rates"]:
        print(f"{row['what']:42}{row['frames_per_s']:9.2f}{'':26}" + " ".join(f"{row['core_ms'][s]:7.1f}" for s in stages))
    if "noise" in result:
        noise = result["noise"]
        print(f"2 bounces, 16 paths: noise {noise['of_indirect']:.1%} of the light between walls, {noise['of_all']:.1%} of all")
    for frames, peak in result.get("peak_mb", {}).items():
        print(f"peak memory of {frames} frames: {peak:.1f} MB")


if __name__ == "__main__":
    main()

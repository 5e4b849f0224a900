#!/usr/bin/env python3
"""A peer of the simulator: the same wall, poses and count of rays in Blender's Cycles, in the same run, as a ratio.

bench/compare_cycles.py [--frames N] [--repetitions N] [--threads N] [--json]

Both write an 8-bit PNG and a depth EXR a frame, rugae also what labels its options leave. rugae's rate is that of its
loop over frames, Cycles' that of the frames after the first, so neither counts making the scene. They take turns;
medians are reported. Where others use the processor too, what all cores spend says more than the clock. Exit code 3: the
depths of the two differ, so the rates say nothing. Skipped where there is no blender.
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
SEQUENCE = ["--scene", "stomach", "--resolution", "medium", "--trajectory", "1", "--seed", "1"]
# The options that say what rugae writes, and what that is; colour and depth are what Cycles writes.
WRITES, WRITTEN = ["--set", "truth.normals=false", "truth.flow=false", "truth.masks=false"], "colour and depth"
LARGEST_DEPTH_DIFFERENCE_MM = 0.05  # a hundredth of a fold; poses 0.3 mm off come to 0.16


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--camera", default="misumi-v5506", help="preset or YAML, Brown-Conrady")
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    if min(arguments.frames, arguments.repetitions + 1, arguments.threads + 1) < 2:
        parser.error("expected at least 2 frames, 1 repetition and 1 thread")
    return arguments


def run(command, path=None):
    """Standard output; a failure ends the comparison with what the program said."""
    environment = {**os.environ, "PATH": path} if path else None
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode:
        sys.exit(f"compare_cycles: {' '.join(command)} ended with {done.returncode}\n{done.stdout[-2000:]}{done.stderr}")
    return done.stdout


def simulate(dataset, arguments):
    shutil.rmtree(dataset, ignore_errors=True)
    numbers = ["--frames", str(arguments.frames), "--threads", str(arguments.threads)]
    command = [RUGAE, "simulate", "--camera", arguments.camera, *SEQUENCE, *WRITES, *numbers, "--json", "--out", dataset]
    return json.loads(run(command))


def render_in_cycles(dataset, out, arguments):
    blender = [shutil.which("blender"), "--background", "--factory-startup", "--python-exit-code", "1"]
    script = ["--python", os.path.join(BENCH, "cycles_frame.py"), "--", dataset, out, "--threads", str(arguments.threads)]
    run(blender + script, path=os.defpath)  # Debian's Blender takes its modules from the first Python in the path
    with open(os.path.join(out, "cycles.json")) as file:
        return json.load(file)


def turn(arguments, work):
    """Both once. Rates in frames a second by the clock; core_ms is what all cores together spend on a frame."""
    dataset, out = os.path.join(work, "data"), os.path.join(work, "cycles")
    rugae = simulate(dataset, arguments)
    cycles = render_in_cycles(dataset, out, arguments)
    rates = {
        "rugae": {
            "frames_per_s": rugae["frames_per_s"],
            "core_ms": 1e3 * sum(rugae["thread_seconds"].values()) / rugae["frames"],
        }
    }
    for name in ("with_files", "without_files"):
        middle = {key: statistics.median(values[1:]) for key, values in cycles[name].items()}
        rates["cycles_" + name] = {"frames_per_s": 1.0 / middle["frame_s"], "core_ms": 1e3 * middle["core_s"]}
    for rate in rates.values():
        rate["ratio"] = rates["rugae"]["frames_per_s"] / rate["frames_per_s"]
        rate["core_ratio"] = rate["core_ms"] / rates["rugae"]["core_ms"]
    return rates, cycles


def compare(arguments, work):
    turns, depths = [], []
    for _ in range(arguments.repetitions):
        rates, cycles = turn(arguments, work)
        turns.append(rates)
        depths.append(cycles["depth_difference_mm"])
    result = {
        who: {key: statistics.median(t[who][key] for t in turns) for key in turns[0][who]} for who in turns[0]
    }
    result["rugae_writes"] = WRITTEN
    result["depth_difference_mm"] = max(depths, key=lambda depth: depth["median"])
    result["versions"] = {"rugae": f"{run([RUGAE, '--version']).strip()} ({commit()})", "blender": cycles["blender"]}
    result.update(camera=arguments.camera, frames=arguments.frames, triangles=cycles["triangles"])
    result.update(threads=arguments.threads, turns=turns)
    return result


def commit():
    done = subprocess.run(["git", "-C", BENCH, "describe", "--always", "--dirty"], capture_output=True, text=True)
    return done.stdout.strip() or "unknown"


def table(r):
    names = {
        "rugae": f"rugae {r['versions']['rugae']}: {r['rugae_writes']}",
        "cycles_with_files": f"Cycles of Blender {r['versions']['blender']}: colour and depth",
        "cycles_without_files": "the same, writing no files",
    }
    wide = max(map(len, names.values()))
    lines = [f"{'':<{wide}}  frames/s   ratio  core ms a frame   ratio"]
    for who, name in names.items():
        v = r[who]
        lines.append(
            f"{name:<{wide}}  {v['frames_per_s']:8.2f}  {v['ratio']:6.2f}  {v['core_ms']:15.0f}  {v['core_ratio']:6.2f}"
        )
    depth = r["depth_difference_mm"]
    lines.append(
        f"{r['camera']}, {r['triangles']} triangles, {r['frames']} frames, {r['threads']} threads; median of "
        f"{len(r['turns'])} turns; ratio: how much faster rugae is"
    )
    lines.append(
        f"z-depths differ by {depth['median']:.6f} mm in the median, {depth['percentile_95']:.6f} mm at 95 %, of "
        f"{depth['pixels']} pixels ({100 * depth['share_in_both']:.0f} % of the grid: where both look)"
    )
    return "\n".join(lines)


def main():
    arguments = parse()
    if not shutil.which("blender"):
        print(json.dumps({"skipped": "no blender here"}) if arguments.json else "SKIPPED: no blender here")
        return 0
    if not os.access(RUGAE, os.X_OK):
        sys.exit("compare_cycles: no build/release/apps/rugae; scripts/build.sh release rugae makes it")
    with tempfile.TemporaryDirectory() as work:
        result = compare(arguments, work)
    print(json.dumps(result, indent=2) if arguments.json else table(result))
    if not result["depth_difference_mm"]["median"] < LARGEST_DEPTH_DIFFERENCE_MM:
        print(f"compare_cycles: the depths differ by more than {LARGEST_DEPTH_DIFFERENCE_MM} mm", file=sys.stderr)
        return 3
    return 0


sys.exit(main())

#!/usr/bin/env python3
"""What each knob of `comber trade` costs and gains by itself: ratios to the default, in one run.

    profiling/knobs.py [--comber FILE] [--runs N] [--folder DIR] SCENE[=OPTIONS]... [-- OPTIONS of `comber trade`]
    profiling/knobs.py CBspheres_lambertian.dae CBbunny.dae 'dragon.ply=--stage cornell' -- -r 120 90 -s 64

For every scene, one reference, rendered beforehand; then every knob is varied by itself, its values and the default in turns. A
cell is time ÷ time of the default, relative MSE ÷ relative MSE of the default, and by how much efficiency, 1 / (relMSE × time),
is higher or lower. The last column is their mean over scenes (geometric). Tables in Markdown; files are kept in DIR.
"""

import argparse
import csv
import math
import pathlib
import subprocess
import sys

# Knob, the default's value, other values; for knobs of adaptive sampling the base is another.
KNOBS = [
    ("samples", "64", ["16", "256"], []),
    ("depth", "5", ["2", "20"], []),
    ("sampler", "sobol", ["independent", "blue-noise"], []),
    ("replicates", "1", ["4", "16"], []),
    ("direct", "mis", ["light", "bsdf", "hemisphere"], []),
    ("light-samples", "1", ["2", "4"], []),
    ("light-sampling", "corners", ["area", "solid-angle"], []),
    ("light-selection", "auto", ["each", "power", "tree"], []),
    ("roulette", "efficiency", ["off", "throughput", "fixed:0.7", "efficiency:0.5", "efficiency:2"], []),
    ("clamp-indirect", "off", ["1", "0.1"], []),
    ("adaptive", "off", ["16:0.1", "16:0.2"], []),
    ("tolerance", "0.1", ["0.05", "0.2"], ["-a", "16", "0.1"]),
    ("confidence", "t", ["z"], ["-a", "16", "0.1"]),
    ("batch", "16", ["8", "32"], ["-a", "16", "0.1"]),
    ("adaptive-tests", "batches", ["doubling"], ["-a", "16", "0.1"]),
    ("adaptive-trust", "once", ["twice", "halves"], ["-a", "16", "0.1"]),
    ("adaptive-area", "tile", ["pixel"], ["-a", "16", "0.1"]),
    ("intersection", "watertight", ["fast"], []),
    ("precision", "f32", ["f64"], []),
    ("bvh", "default", ["fast", "best"], []),
    ("nodes", "auto", ["full", "compact"], []),
    ("leaves", "auto", ["compact"], []),
    ("reuse", "1", ["4", "16", "64"], []),
    ("lamp-rays", "1", ["16"], []),
    ("wave", "8192", ["256", "1048576"], []),
]


def run(comber, arguments):
    """Runs comber and ends with what it says if it fails."""
    done = subprocess.run([comber, *arguments], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"comber {' '.join(arguments)}\n{done.stderr}")


def measure(comber, scene, options, reference, knob, runs, folder):
    """Rows of one knob, by value: seconds, relMSE and its relative standard error."""
    name, default, others, base = knob
    table = folder / f"{name}.csv"
    values = ",".join([default, *others])
    arguments = ["trade", scene, *options, *base, "--reference", str(reference), "--vary", f"{name}={values}"]
    run(comber, [*arguments, "--runs", str(runs), "--csv", str(table)])
    with open(table, newline="") as file:
        rows = {next(iter(row.values())): row for row in csv.DictReader(file)}
    for value, row in rows.items():
        seconds, error = float(row["seconds"]), float(row["relmse"])
        rows[value] = (seconds, error, float(row["relmse_stderr"]) / error if error else 0.0, row["bias_test_z"])
    return rows


def main():
    words = sys.argv[1:]
    common = words[words.index("--") + 1 :] if "--" in words else []
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--comber", default="target/release/comber", help="the binary")
    parser.add_argument("--runs", type=int, default=6, help="renders of each value")
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("target/knobs"), help="where files are kept")
    parser.add_argument("--only", default="", help="knobs, separated by commas")
    parser.add_argument("scenes", nargs="+", metavar="SCENE[=OPTIONS]")
    words = parser.parse_args(words[: words.index("--")] if "--" in words else words)
    scenes = []
    for scene in words.scenes:
        file, _, options = scene.partition("=")
        name = pathlib.Path(file).stem
        folder = words.folder / name
        folder.mkdir(parents=True, exist_ok=True)
        reference = folder / "reference.exr"
        options = [*options.split(), *common]
        plain = [word for word in options]
        for flag in ("-s", "--samples"):
            if flag in plain:
                at = plain.index(flag)
                del plain[at : at + 2]
        # What less depth leaves out shows beside much depth alone.
        deep = folder / "deep.exr"
        for picture, depth in [(reference, []), (deep, ["-m", "100"])]:
            arguments = ["reference", file, *plain, *depth, "--rel-error", "0.01", "-o", str(picture)]
            run(words.comber, [*arguments, *(["--resume"] if picture.exists() else [])])
        scenes.append((name, file, options, {"depth": deep}, reference, folder))
    print("| knob | value | " + " | ".join(name for name, *_ in scenes) + " | time | relMSE | **efficiency** |")
    print("|---|---|" + "--:|" * (len(scenes) + 3))
    for knob in KNOBS:
        name, default, others, _ = knob
        if words.only and name not in words.only.split(","):
            continue
        rows = [
            measure(words.comber, file, options, special.get(name, reference), knob, words.runs, folder)
            for _, file, options, special, reference, folder in scenes
        ]
        for value in others:
            cells, times, errors = [], [], []
            for row in rows:
                time, error = row[value][0] / row[default][0], row[value][1] / row[default][1]
                times.append(math.log(time))
                errors.append(math.log(error))
                biased = "*" if float(row[value][3] or 0) > 3 else ""
                cells.append(f"{time:.2f} {error:.2f}{biased}")
            time, error = (math.exp(sum(of) / len(of)) for of in (times, errors))
            print(f"| {name} | {value} | " + " | ".join(cells) + f" | {time:.2f} | {error:.2f} | **{1 / (time * error):.2f}** |", flush=True)


main()

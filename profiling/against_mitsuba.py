#!/usr/bin/env python3
"""How much sooner comber reaches the error of Mitsuba 3, on this machine, in the same scenes at the same depth.

    profiling/against_mitsuba.py box.dae dragon.ply box.dae=reference.exr [--json FILE]

A SCENE is a .dae file with one area light, or a bare .ply or .obj mesh, which stands in comber's Cornell box. After `=`
may follow a picture of it that both are tested against, its standard errors beside it (NAME.exr, NAME.stderr.exr).
Needs `pip install mitsuba numpy`, and an LLVM that Mitsuba can use: 15 is too old, 19 and 22 are not (Debian:
`apt install libllvm19`). The newest of the system is taken, or what DRJIT_LIBLLVM_PATH names.

Time is rendering alone: comber's own account of it, and Mitsuba's render call once a first one has compiled its kernels
(what that takes is told apart). Errors are variances between runs of different seeds, which need no reference; they are
all of the error if the pictures have no bias, which the second table tests. relMSE and MSE are of pixels of which no sample sees
the lamp, whole MSE is of all: there the lamp's edges weigh most. The renderers take turns, so that a busy
machine slows both.
"""
import argparse
import glob
import itertools
import json
import os
import re
import resource
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

FOLDER = tempfile.TemporaryDirectory()
# Kernels kept by earlier runs would hide what compiling takes; the variable is read when Mitsuba is imported.
os.environ["DRJIT_CACHE_DIR"] = FOLDER.name
try:
    import drjit as dr
    import mitsuba as mi
    import numpy as np
except ImportError as error:
    sys.exit(f"against_mitsuba.py: {error}; `pip install mitsuba numpy` brings both")

from equal_error import EPSILON, Row, agreement, ratios
from mitsuba_scene import Failure, load_scene, load_sensor

ROOT = Path(__file__).resolve().parent.parent
Z_MOST = 5.0  # standard errors that two pictures' means, or blocks, may lie apart


# ------------------------------------------------------------------------------------------------------- renderers
class Mitsuba:
    """One sampler of Mitsuba, its kernels compiled."""

    def __init__(self, scene, sampler, camera, size):
        self.name, self.sampler, self.scene = "mitsuba", sampler, scene
        self.sensor = load_sensor(camera, sampler, size)
        # Compiled on one thread: its processor time is what it takes on an idle machine.
        first, again = (self.render(4, seed)[2] for seed in (8000, 8001))
        self.compiling = max(0.0, first - again)

    def render(self, samples, seed):
        """Samples taken (some samplers round), seconds, processor seconds, picture."""
        wall, cpu = time.perf_counter(), time.process_time()
        image = mi.render(self.scene, sensor=self.sensor, spp=samples, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        return self.sensor.sampler().sample_count(), wall, cpu, np.array(image, np.float64)


class Comber:
    """One sampler of comber."""

    def __init__(self, args, path, sampler, size):
        self.name, self.sampler = "comber", sampler
        self.picture = Path(FOLDER.name) / "comber.exr"
        self.command = [args.comber, "render", str(path), *comber_scene(path), "--json", "-o", str(self.picture),
                        "-r", *map(str, size), "-t", str(args.threads), "-m", str(args.depth), "--sampler", sampler,
                        # Every run builds its tree, those that measure the overhead too.
                        "--cache", "off", *shlex.split(args.comber_options)]
        # Processor time that is not rendering: reading, building and writing. The first run, with the files not read yet, does not count.
        self.overhead = float(np.median([self._run("-s", "1", "-m", "0")[1] for _ in range(4)][1:]))

    def _run(self, *more):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        report = json.loads(run([*self.command, *more]))
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return report, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    def render(self, samples, seed):
        report, cpu = self._run("-s", str(samples), "--seed", str(seed))
        return samples, report["seconds"]["render"], max(cpu - self.overhead, 1e-3), read_exr(self.picture)

    def lamp_free(self):
        """Pixels of which no sample sees the lamp: what errors are taken over."""
        self._run("--integrator", "zero-bounce", "-s", "256")
        return read_exr(self.picture).max(2) == 0


def comber_scene(path):
    """Options that make comber show what the script gives Mitsuba."""
    return ["--normals", "flat"] + (["--stage", "cornell"] if path.suffix != ".dae" else [])


def run(command):
    try:
        done = subprocess.run(command, capture_output=True, text=True)
    except OSError as error:
        hint = "build comber with `cargo build --release`, or give --comber"
        raise Failure(f"{command[0]}: {error.strerror}; {hint}") from error
    if done.returncode != 0:
        raise Failure(f"{' '.join(command)}\nfailed with {done.returncode}: {done.stderr.strip()}")
    return done.stdout


def read_exr(path):
    """Height × width × 3, whatever other channels there are."""
    bitmap = mi.Bitmap(str(path))
    names = [field.name for field in bitmap.struct_()]
    return np.array(bitmap, np.float64)[..., [names.index(channel) for channel in "RGB"]]


# --------------------------------------------------------------------------------------------------------- one scene
def best_sampler(samplers, scene, camera, size, samples, mask):
    """Mitsuba with the sampler of the least relMSE × processor time in three runs each, and the products of all."""
    trial = []
    for sampler in samplers:
        row = Row(Mitsuba(scene, sampler, camera, size), samples)
        for seed in range(3):
            row.measure(9000 + seed)
        row.judge(np.mean(row.pictures, 0), mask)
        trial.append((row.errors["relMSE"] * float(np.median(row.cpu)), row.renderer))
    return min(trial, key=lambda t: t[0])[1], {renderer.sampler: product for product, renderer in trial}


def compare(args, scene_argument):
    name, _, reference = scene_argument.partition("=")
    path = Path(name)
    if path.suffix not in (".dae", ".ply", ".obj") or not path.is_file():
        raise Failure(f"{path}: expected a .dae, .ply or .obj file")
    truth = read_exr(reference) if reference else None
    errors = read_exr(Path(reference).with_suffix(".stderr.exr")) if reference else None
    size = args.size if truth is None else list(truth.shape[1::-1])
    info = run([args.comber, "info", str(path), *comber_scene(path), "-r", *map(str, size), "--json"])
    camera = json.loads(info)["camera"]
    scene = load_scene(path, args.depth)
    ours = [Comber(args, path, sampler, size) for sampler in args.comber_samplers]
    mask = ours[0].lamp_free()
    independent = Mitsuba(scene, "independent", camera, size)
    middle = min(args.samples, key=lambda n: abs(n - 64))
    best, trial = best_sampler(args.mitsuba_samplers, scene, camera, size, middle, mask)
    theirs = [independent, best]
    rows = [Row(renderer, n) for renderer in ours for n in [1, *args.samples]]
    rows += [Row(renderer, n) for renderer in theirs for n in args.samples]
    rows.sort(key=lambda row: row.asked)  # renders of one size in turns, so that what disturbs meets both
    for turn, row in itertools.product(range(args.runs), rows):
        row.measure(1000 * turn + rows.index(row))
    largest = [row for row in rows if row.asked == args.samples[-1]]
    mean = np.mean([row.pictures for row in largest], (0, 1)) if truth is None else truth
    for row in rows:
        row.judge(mean, mask)
    if truth is None:
        against = next(row for row in largest if row.renderer is theirs[0])
        largest.remove(against)
        truth, errors = against.mean, np.sqrt(against.variance / args.runs)
    checks = [{"renderer": row.renderer.name, "sampler": row.renderer.sampler} | agreement(row, truth, errors**2)
              for row in largest]
    curve = [row for row in rows if row.renderer is ours[0]]
    found = [ratios(row, curve) for renderer in theirs for row in rows if row.renderer is renderer]
    return {"scene": path.name, "size": size, "reference": Path(reference).name or None, "trial": trial,
            "compiling_seconds": {renderer.sampler: renderer.compiling for renderer in theirs},
            "rows": [row.fields() for renderer in ours + theirs for row in rows if row.renderer is renderer],
            "checks": checks, "ratios": found}


def report(result, args):
    width, height = result["size"]
    print(f"\n{result['scene']}, {width} × {height}, {args.depth} bounces, {args.threads} threads, {args.runs} turns: "
          "medians [quartiles]")
    print(f"{'':8} {'sampler':12} {'spp':>4} {'seconds':>8} {'[':>8}{']':>8} {'cpu':>8} {'relMSE':>9} {'MSE':>9} "
          f"{'whole MSE':>10} {'s × relMSE':>10}")
    for row in result["rows"]:
        low, middle, high = np.quantile(row["seconds"], [0.25, 0.5, 0.75])
        print(f"{row['renderer']:8} {row['sampler']:12} {row['samples']:4} {middle:8.3f} {low:8.3f}{high:8.3f} "
              f"{np.median(row['cpu_seconds']):8.3f} {row['relMSE']:9.3e} {row['MSE']:9.3e} "
              f"{row['whole MSE']:10.3e} {middle * row['relMSE']:10.3e}")
    trial = sorted(result["trial"].items(), key=lambda item: item[1])
    print("Trial of Mitsuba's samplers, relMSE × cpu: " + ", ".join(f"{name} {product:.2e}" for name, product in trial))
    compiling = result["compiling_seconds"].items()
    print("Compiling Mitsuba's kernels, apart: " + ", ".join(f"{name} {seconds:.2f} s" for name, seconds in compiling))

    print(f"\nThe same picture as {result['reference'] or 'that of Mitsuba, independent'}?")
    print(f"{'':8} {'sampler':12} {'mean':>9} {'z of it':>8} {'z of worst block':>17} {'squares':>8}")
    for check in result["checks"]:
        doubt = "  DIFFERS" if max(check["z"], check["block_z"]) > Z_MOST else ""
        print(f"{check['renderer']:8} {check['sampler']:12} {check['difference']:+9.3%} {check['z']:8.2f} "
              f"{check['block_z']:17.2f} {check['squares']:8.3f}{doubt}")

    print(f"\nTime to equal error, Mitsuba over comber ({args.comber_samplers[0]})")
    print(f"{'sampler':12} {'spp':>4} {'relMSE':>8} {'[':>8}{']':>8} {'by cpu':>8} {'MSE':>8} {'whole MSE':>10} {'compiling':>10} "
          f"{'products':>9}")
    for row in result["ratios"]:
        low, middle, high = row["relMSE"]
        others = [row[key][1] for key in ("relMSE_cpu", "MSE", "whole MSE", "relMSE_compiling", "products")]
        print("{:12} {:4} {:8.2f} {:8.2f}{:8.2f} {:8.2f} {:8.2f} {:10.2f} {:10.2f} {:9.2f}".format(
            row["sampler"], row["samples"], middle, low, high, *others)
            + ("  beyond comber's runs: extrapolated" if row["extrapolated"] else ""))


# -------------------------------------------------------------------------------------------------------------- main
def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)

    def numbers(text):
        return sorted({count(n) for n in text.split(",")})

    parser.add_argument("scenes", nargs="+", metavar="SCENE[=REFERENCE.exr]")
    parser.add_argument("--comber", metavar="PATH", help="the binary [default: $COMBER, else target/release/comber]",
                        default=os.environ.get("COMBER", str(ROOT / "target/release/comber")))
    parser.add_argument("--comber-samplers", default=["sobol", "independent"], type=lambda text: text.split(","),
                        metavar="A,B,…", help="ratios are of the first [default: sobol,independent]")
    parser.add_argument("--mitsuba-samplers", default=["multijitter", "stratified", "ldsampler", "orthogonal"],
                        type=lambda text: text.split(","), metavar="A,B,…",
                        help="the one best in a trial stands beside `independent` [default: all that there are]")
    parser.add_argument("--comber-options", default="", metavar="'…'", help="further options of `comber render`")
    parser.add_argument("--samples", default="4,16,64,256", type=numbers, metavar="N,N,…",
                        help="samples a pixel; powers of 4 suit all but orthogonal, which rounds [default: 4,16,64,256]")
    parser.add_argument("--depth", default=5, type=count, help="most bounces, as comber counts them [default: 5]")
    parser.add_argument("--size", default=[240, 180], nargs=2, type=count, metavar=("W", "H"),
                        help="pixels [default: the reference's, else 240 180]")
    parser.add_argument("--runs", default=5, type=count, help="turns, 3 or more [default: 5]")
    parser.add_argument("--threads", default=len(os.sched_getaffinity(0)), type=count,
                        help="of each renderer [default: one a processor]")
    parser.add_argument("--variant", default="llvm_ad_rgb", help="of Mitsuba [default: llvm_ad_rgb]")
    parser.add_argument("--json", metavar="FILE", help="write every run and result here")
    args = parser.parse_args()
    if len(args.samples) < 2 or args.runs < 3:
        parser.error("errors and their course need --runs of 3 or more and two or more --samples")
    return args


def count(text):
    number = int(text)
    if number < 1:
        raise ValueError(text)
    return number


def start_mitsuba(args):
    """Sets Mitsuba up. It is first tried in a process of its own: an LLVM that does not suit aborts the process."""
    if "DRJIT_LIBLLVM_PATH" not in os.environ:
        places = ("/usr/lib/*/", "/usr/lib/", "/usr/lib64/")
        names = [name for place in places for name in glob.glob(place + "libLLVM*")]
        numbered = [(int(number[1]), name) for name in names if (number := re.search(r"libLLVM[-.a-z]*(\d+)", name))]
        if numbered:
            os.environ["DRJIT_LIBLLVM_PATH"] = max(numbered)[1]
    probe = (f"import mitsuba as mi; mi.set_variant({args.variant!r}); "
             "mi.render(mi.load_dict(mi.cornell_box()), spp=1).numpy()")
    with tempfile.TemporaryDirectory() as kernels:
        environment = os.environ | {"DRJIT_CACHE_DIR": kernels}
        tried = subprocess.run([sys.executable, "-P", "-c", probe], capture_output=True, text=True, env=environment)
    if tried.returncode != 0:
        llvm, said = os.environ.get("DRJIT_LIBLLVM_PATH", "not found"), tried.stderr.strip().splitlines()
        raise Failure(f"Mitsuba's variant {args.variant} does not run here. Those named llvm need an LLVM newer than 15 "
                      f"(here: {llvm}): `apt install libllvm19`, or set DRJIT_LIBLLVM_PATH to a libLLVM.so. "
                      "Else take --variant scalar_rgb.\n" + "\n".join(said[:3]))
    mi.set_variant(args.variant)
    mi.set_log_level(mi.LogLevel.Error)
    dr.set_thread_count(args.threads)


def write_json(path, document):
    """Under a temporary name first: whoever reads FILE finds all of it."""
    partial = Path(f"{path}.{os.getpid()}.part")
    try:
        partial.write_text(json.dumps(document, indent=1))
        partial.replace(path)
    except OSError as error:
        raise Failure(f"{path}: {error.strerror}") from error


def main():
    args = arguments()
    start_mitsuba(args)
    version = run([args.comber, "--version"]).strip()
    about = {"comber": version, "options": args.comber_options, "mitsuba": mi.__version__, "variant": args.variant,
             "depth": args.depth, "threads": args.threads, "epsilon": EPSILON}
    print(f"{version} {args.comber_options}".strip() + f" beside Mitsuba {mi.__version__} {args.variant}, "
          f"load {os.getloadavg()[0]:.1f}")
    results = []
    for scene in args.scenes:
        results.append(compare(args, scene))
        report(results[-1], args)
        if args.json:
            write_json(args.json, about | {"scenes": results})


if __name__ == "__main__":
    try:
        main()
    except (Failure, RuntimeError) as failure:  # the second are Mitsuba's, of files it cannot read among others
        sys.exit(f"against_mitsuba.py: {failure}")

#!/usr/bin/env python3
"""Trees of other languages on luxmap's photons, one thread: nanoflann (C++), pykdtree (C), scipy's cKDTree (C++).

    cargo build --release && python3 benches/other_trees/compare.py [SCENE] [--photons N] [--rounds N]

In each round `luxmap trees` runs and dumps its photons, then the others are measured on exactly these; the table has the
medians of the rounds. The others have to find the same sums of R and of flux; these sums are part of each measure, as they
are of luxmap's. The others know no search radius for the k nearest; luxmap's is a tenth of the room's diagonal, which holds
k photons unless there are few. Packages go into target/other_trees/, nothing into the system; nanoflann's header is the
system's, or that of Debian's libnanoflann-dev.
"""

import argparse
import csv
import os
import statistics
import subprocess
import sys
import time
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
PLACE = ROOT / "target" / "other_trees"


def prepare_python():
    """Goes on in a virtual environment that has the packages."""
    python = PLACE / "venv" / "bin" / "python"
    if Path(sys.prefix).resolve() == (PLACE / "venv").resolve():
        return
    if not python.exists():
        venv.create(PLACE / "venv", with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", "numpy", "scipy", "pykdtree"], check=True)
    os.environ["OMP_NUM_THREADS"] = "1"  # pykdtree takes all threads otherwise
    os.execv(python, [str(python), __file__, *sys.argv[1:]])


def build_nanoflann():
    """Compiles the small program beside this one."""
    include = []
    if not Path("/usr/include/nanoflann.hpp").exists():
        if not (PLACE / "usr/include/nanoflann.hpp").exists():
            subprocess.run(["apt-get", "download", "--quiet", "libnanoflann-dev"], cwd=PLACE, check=True)
            package = next(PLACE.glob("libnanoflann-dev_*.deb"))
            subprocess.run(["dpkg", "-x", package, PLACE], check=True)
        include = ["-I", PLACE / "usr/include"]
    program = PLACE / "nanoflann"
    subprocess.run(["g++", "-O3", "-march=native", "-std=c++17", *include, HERE / "nanoflann.cpp", "-o", program],
                   check=True)
    return program


def luxmap(arguments, dump):
    """Runs `luxmap trees`; returns {(tree, measure): (value, None, None)} by kind of points."""
    command = [arguments.luxmap, "trees", "--quiet", "--sets", "scene", "--threads", "1", "-o", PLACE / "luxmap"]
    command += ["--photons", str(arguments.photons), "--nearest", arguments.nearest, "--radius", arguments.radius]
    command += ["--dump-photons", dump] + ([arguments.scene] if arguments.scene else [])
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    found = {"floor": {}, "random": {}}
    with open(PLACE / "luxmap" / "trees.csv", newline="") as file:
        for row in csv.DictReader(file):
            if row["queries"] in found:
                measures = found[row["queries"]]
                measure = row["k"] or "r" + row["radius_m"]
                tree = f"luxmap’s {row['tree']}" if row["tree"] == "paper" else row["tree"]
                measures[tree, "build"] = (float(row["build_ms"]), None, None)
                measures[tree, measure] = (float(row["ns_per_query"]), None, None)
    return found


def nanoflann(program, arguments, files):
    found = {}
    command = [program, *files, arguments.nearest, arguments.radius]
    for line in subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines():
        measure, value, radii, flux = line.split()
        found["nanoflann", measure] = (float(value), float(radii), float(flux))
    return found


def in_python(name, arguments, files):
    """pykdtree or scipy, asked for all points at once."""
    import numpy

    photons, flux, points = (numpy.load(file) for file in files)
    found = {}

    def measured(measure, unit, work):
        start = time.perf_counter()
        radii, sums = work()
        found[name, measure] = (unit * (time.perf_counter() - start), radii, sums)

    def build():
        nonlocal tree
        if name == "pykdtree":
            from pykdtree.kdtree import KDTree

            tree = KDTree(photons, leafsize=32)
        else:
            from scipy.spatial import cKDTree

            tree = cKDTree(photons, leafsize=32)
        return 0.0, 0.0

    def nearest(k):
        distances, indices = tree.query(points, k=k)
        distances, indices = distances.reshape(len(points), k), indices.reshape(len(points), k)
        return float(distances[:, -1].sum(dtype=float)), float(flux[indices].sum(dtype=float))

    def within(radius):
        total = 0.0
        for at, indices in zip(points, tree.query_ball_point(points, radius)):
            away = photons[indices] - at
            kernel = 1 - (away * away).sum(axis=1) / radius**2
            total += float((flux[indices] * kernel).sum(dtype=float))
        return 0.0, total

    tree = None
    build()  # loads the library
    measured("build", 1e3, build)
    for k in map(int, arguments.nearest.split(",")):
        measured(str(k), 1e9 / len(points), lambda: nearest(k))
    if name == "scipy":  # pykdtree has no such query
        for radius in arguments.radius.split(","):
            measured("r" + radius, 1e9 / len(points), lambda: within(float(radius)))
    return found


def agree(found):
    """Sums of R and flux are the same for all trees, up to single precision."""
    for (tree, measure), (_, radii, flux) in found.items():
        reference = found.get(("nanoflann", measure))
        if radii is None or measure == "build":
            continue
        for what, value, expected in (("R", radii, reference[1]), ("flux", flux, reference[2])):
            if abs(value - expected) > 1e-4 * abs(expected):
                sys.exit(f"{tree}, {measure}: found a sum of {what} of {value}, nanoflann {expected}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", help="scene file [default: luxmap's own]")
    parser.add_argument("--photons", type=int, default=300_000)
    parser.add_argument("--nearest", default="10,100,500")
    parser.add_argument("--radius", default="0.05,0.2")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--luxmap", default=ROOT / "target" / "release" / "luxmap")
    arguments = parser.parse_args()
    PLACE.mkdir(parents=True, exist_ok=True)
    prepare_python()
    program = build_nanoflann()

    dump = PLACE / "photons.npy"
    rounds = {"floor": [], "random": []}
    for _ in range(arguments.rounds):
        ours = luxmap(arguments, dump)
        for at, measured in rounds.items():
            files = [dump, PLACE / "photons.flux.npy", PLACE / f"photons.{at}.npy"]
            found = ours[at] | nanoflann(program, arguments, files)
            found |= in_python("pykdtree", arguments, files) | in_python("scipy", arguments, files)
            agree(found)
            measured.append(found)

    rows = []
    for at, measured in rounds.items():
        medians = {key: statistics.median(found[key][0] for found in measured) for key in measured[0]}
        for (tree, measure), value in medians.items():
            rows.append([at, tree, measure, value, value / medians["kd", measure]])
    with open(PLACE / "other_trees.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["queries", "tree", "measure", "build_ms_or_ns_per_query", "ratio_to_kd"])
        writer.writerows(rows)
    print(f"{arguments.photons} photons, one thread, medians of {arguments.rounds} rounds; in brackets: time ÷ kd’s")
    measures = list(dict.fromkeys(row[2] for row in rows))
    for at in rounds:
        unit = {"build": "build, ms"}
        print(f"\n{at:<16}" + "".join(f"{unit.get(m, m + ', ns'):>20}" for m in measures))
        for tree in dict.fromkeys(row[1] for row in rows):
            cells = {row[2]: f"{row[3]:.3g} ({row[4]:.2f})" if row[3] < 1e3 else f"{row[3]:.0f} ({row[4]:.2f})"
                     for row in rows if row[:2] == [at, tree]}
            print(f"{tree:<16}" + "".join(f"{cells.get(m, '–'):>20}" for m in measures))


main()

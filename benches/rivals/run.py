#!/usr/bin/env python3
"""Sets luxmap against Radiance and Mitsuba 3: time and error of each at the points of measuring planes.

    python3 benches/rivals/run.py                                   # the seed office, both planes
    python3 benches/rivals/run.py --scene S.toml --plane P --reference P.csv

Builds luxmap, sets the other tools up inside target/rivals (see environment.py), converts the scene for them, and lets
all contenders take turns. README.md beside this file tells what is compared and what is not.
"""

from __future__ import annotations

import environment

if __name__ == "__main__":
    environment.enter()

import argparse
import csv
import dataclasses
import datetime
import io
import json
import os
import platform
import resource
import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import maps
import mitsuba_scene
import radiance
from environment import HOME, PROJECT, say
from scene import REC709, Plane, Scene, Unsupported, load

# --- contenders: edit these ------------------------------------------------------------------------------------------

LUXMAP = [
    "--error 1",
    "--error 0.5",
    "--method split --photons 1000000",
    "--method split --photons 3000000",
    "--method split --photons 5000000",
]
"""Options of `luxmap render`; what the built luxmap does not know is left out, and said so."""

RADIANCE = [
    radiance.Setting(
        "photon map, final gather, finest",
        "1000000",
        "-ab 1 -aa .15 -ar 64 -ad 192 -as 0 -ds .05 -dj .8 -dt 0 -dc 1",
    ),
    radiance.Setting(
        "photon map, final gather, fine",
        "300000",
        "-ab 1 -aa .2 -ar 64 -ad 256 -as 64 -ds .05 -dj .8 -dt 0 -dc 1",
    ),
    radiance.Setting(
        "photon map, final gather, medium",
        "300000",
        "-ab 1 -aa .2 -ar 32 -ad 192 -as 0 -ds .08 -dj .8",
    ),
    radiance.Setting(
        "photon map, final gather, coarse",
        "300000",
        "-ab 1 -aa .2 -ar 32 -ad 128 -as 0 -ds .1 -dj .8",
    ),
    radiance.Setting("classic ambient, fine", None, "-ab 5 -aa .2 -ar 32 -ad 128 -as 0 -ds .1 -dj .8"),
    radiance.Setting("classic ambient, coarse", None, "-ab 5 -aa .3 -ar 16 -ad 64 -as 0 -ds .1 -dj .8"),
]
"""On the seed office the finest is the quickest found to reach 1 % on the floor, the medium one at 0.75 m."""

MITSUBA_SAMPLES = [128, 512]
"""Paths a point. Two at least: their times tell what the start costs, and so what more samples would."""

CHECKED_PLACES = 200
"""Before the turns each rival computes so many places, drawn at random, with a setting that spares nothing."""

RADIANCE_CHECK = radiance.Setting(
    "without caches", None, "-ab 12 -lr -12 -lw 1e-5 -aa 0 -ad 256 -as 0 -ds .05 -dj 1 -dt 0 -dc 1"
)
MITSUBA_CHECK = 8192

AGREEMENT = {"Radiance": 1.0, "Mitsuba": 0.5}
"""Largest difference of the mean, %, found there; beyond, the converted scene is thought to be another one."""

# ---------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Job:
    """A plane to be measured."""

    plane: Plane
    reference: maps.Reference
    points: np.ndarray  # position and normal of each place, one a row
    folder: Path


@dataclass(frozen=True)
class Contender:
    """A tool with one setting. `work` is timed; `read` gives E at the job's points, lx, and is not."""

    tool: str
    setting: str
    work: Callable[[Job, int], None]
    read: Callable[[Job], np.ndarray]
    samples: int = 0  # of an unbiased method, whose error falls as 1/√samples


@dataclass(frozen=True)
class Run:
    """One contender at one plane in one turn."""

    plane: str
    tool: str
    setting: str
    turn: int
    seconds: float
    cpu_seconds: float
    rmse_percent: float
    bias_percent: float


@dataclass(frozen=True)
class Line:
    """The medians of a contender at a plane."""

    plane: str
    tool: str
    setting: str
    turns: int
    seconds: float
    cpu_seconds: float
    rmse_percent: float
    bias_percent: float
    samples: int
    extrapolated: bool = False


class LeftOut(Exception):
    """A contender that can't take part."""


# --- the three tools -------------------------------------------------------------------------------------------------


def luxmap_contenders(scene_file: Path, threads: int) -> list[Contender]:
    binary = PROJECT / "target" / "release" / "luxmap"

    def work(options: str, job: Job, turn: int) -> None:
        command: list[str | Path] = [binary, "render", scene_file, "--plane", job.plane.name, "--quiet"]
        command += ["--threads", str(threads), "--seed", str(turn), "-o", job.folder / "luxmap", *shlex.split(options)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise LeftOut(done.stderr.strip())

    def read(job: Job) -> np.ndarray:
        found = maps.read_csv(job.folder / "luxmap" / f"{job.plane.name}.csv")
        return found.illuminance[job.reference.is_place]

    return [Contender("luxmap", options, partial(work, options), read) for options in LUXMAP]


def radiance_contenders(scene: Scene, threads: int, folder: Path, settings: list[radiance.Setting]) -> list[Contender]:
    rad = radiance.write(scene, folder)

    def work(setting: radiance.Setting, job: Job, _: int) -> None:
        np.save(job.folder / "radiance.npy", radiance.run(rad, job.points, setting, threads, job.folder))

    def read(job: Job) -> np.ndarray:
        return np.load(job.folder / "radiance.npy") @ REC709

    return [Contender("Radiance", setting.name, partial(work, setting), read) for setting in settings]


def mitsuba_contenders(
    scene: Scene, threads: int, folder: Path, variables: dict[str, str], samples: list[int]
) -> list[Contender]:
    xml = mitsuba_scene.write(scene, folder)
    variant = "llvm_ad_rgb" if scene.coloured else "llvm_ad_mono"
    # Dr.Jit keeps compiled kernels under the home folder; from the second turn on it finds them there.
    variables = {**os.environ, **variables, "HOME": str(HOME)}

    def work(samples: int, job: Job, turn: int) -> None:
        command: list[str | Path] = [sys.executable, Path(__file__).with_name("mitsuba_trace.py")]
        command += [
            xml,
            job.folder / "points.npy",
            job.folder / "mitsuba.npy",
            "--variant",
            variant,
            "--samples",
            str(samples),
        ]
        command += ["--threads", str(threads), "--seed", str(turn)]
        done = subprocess.run(command, env=variables, capture_output=True, text=True, check=False)
        if done.returncode:
            raise LeftOut((done.stderr.strip() or f"ended with {done.returncode}").splitlines()[-1])

    def read(job: Job) -> np.ndarray:
        found = np.load(job.folder / "mitsuba.npy")
        return found @ REC709 if scene.coloured else found[:, 0]

    return [Contender("Mitsuba", f"{count} paths a point", partial(work, count), read, count) for count in samples]


# --- is it the same scene? -------------------------------------------------------------------------------------------


def thinned(job: Job) -> Job:
    """The same job at a few places only, in a folder of its own."""
    places = np.flatnonzero(job.reference.is_place)
    chosen = np.sort(np.random.default_rng(0).permutation(len(places))[:CHECKED_PLACES])
    illuminance = np.full_like(job.reference.illuminance, np.nan)
    illuminance[places[chosen]] = job.reference.illuminance[places[chosen]]
    return make_job(job.plane, maps.Reference(illuminance, None), job.points[chosen], job.folder / "check")


def check(contender: Contender, jobs: list[Job]) -> bool:
    """Whether a tool's mean agrees with the reference at a few places of each plane."""
    agrees = True
    for job in map(thinned, jobs):
        run = measure(contender, job, 0)
        good = abs(run.bias_percent) <= AGREEMENT[run.tool]
        print(f"check     {run.plane}: {run.tool}'s mean at {len(job.points)} places {run.bias_percent:+.2f} %"
              f"{'' if good else ': NOT THE SAME SCENE?'}", flush=True)  # fmt: skip
        agrees &= good
    return agrees


# --- turns -----------------------------------------------------------------------------------------------------------


def cpu_of_children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def measure(contender: Contender, job: Job, turn: int) -> Run:
    """One run: wall and processor seconds of whole processes, then the distance from the reference."""
    cpu, clock = cpu_of_children(), time.perf_counter()
    contender.work(job, turn)
    seconds, cpu_seconds = time.perf_counter() - clock, cpu_of_children() - cpu
    score = maps.score(contender.read(job), job.reference)
    return Run(job.plane.name, contender.tool, contender.setting, turn, seconds, cpu_seconds, score.rmse, score.bias)


def take_turns(contenders: list[Contender], jobs: list[Job], repeats: int, budget: float) -> list[Run]:
    """All contenders at all planes, again and again; no further turn that would end beyond the budget (s)."""
    runs: list[Run] = []
    began = time.perf_counter()
    taking_part = list(contenders)
    for turn in range(repeats):
        turn_began = time.perf_counter()
        if turn and turn_began - began + (turn_began - began) / turn > budget:
            say(f"{turn} of {repeats} turns: the budget of {budget:g} s is used up")
            break
        for contender in list(taking_part):
            for job in jobs:
                try:
                    run = measure(contender, job, turn)
                except (LeftOut, RuntimeError) as why:
                    say(f"{contender.tool} {contender.setting} left out: {why}")
                    taking_part.remove(contender)
                    break
                runs.append(run)
                result = f"{run.seconds:.2f} s, {run.rmse_percent:.2f} %"
                say(f"turn {turn + 1}: {run.plane}: {run.tool} {run.setting}: {result}")
    return runs


def medians(runs: list[Run], contenders: list[Contender], jobs: list[Job]) -> list[Line]:
    lines = []
    for job in jobs:
        for contender in contenders:
            key = (job.plane.name, contender.tool, contender.setting)
            own = [run for run in runs if (run.plane, run.tool, run.setting) == key]
            if own:
                columns = ("seconds", "cpu_seconds", "rmse_percent", "bias_percent")
                values = {name: median(getattr(run, name) for run in own) for name in columns}
                lines.append(Line(*key, turns=len(own), samples=contender.samples, **values))
    return lines


# --- who reaches the target, and when --------------------------------------------------------------------------------


def extrapolate(lines: list[Line], target: float, noise: float) -> Line | None:
    """When an unbiased tool would reach the target: time is linear in samples, variance goes as their inverse.

    The reference's own noise (%) is part of every RMSE, and no samples take it away.
    """
    own = sorted((line for line in lines if line.samples), key=lambda line: line.samples)
    if len(own) < 2 or noise >= target:
        return None
    few, many = own[0], own[-1]
    needed = many.samples * (many.rmse_percent**2 - noise**2) / (target**2 - noise**2)

    def at(column: str) -> float:
        a, b = getattr(few, column), getattr(many, column)
        return b + (b - a) / (many.samples - few.samples) * (needed - many.samples)

    return dataclasses.replace(
        many,
        setting=f"{needed:.0f} paths a point",
        seconds=at("seconds"),
        cpu_seconds=at("cpu_seconds"),
        rmse_percent=target,
        samples=round(needed),
        extrapolated=True,
    )


def quickest(lines: list[Line], target: float, noise: float) -> Line | None:
    """A tool's quickest setting that reaches the target on a plane; measured, if any did."""
    reached = [line for line in lines if line.rmse_percent <= target]
    return min(reached, key=lambda line: line.seconds) if reached else extrapolate(lines, target, noise)


@dataclass(frozen=True)
class Verdict:
    """A rival's way to the target against luxmap's; ratios above 1 say that luxmap is quicker."""

    plane: str
    tool: str
    line: Line | None
    ratio: float | None
    cpu_ratio: float | None


def verdicts(lines: list[Line], jobs: list[Job], target: float) -> list[Verdict]:
    found = []
    for job in jobs:
        here = [line for line in lines if line.plane == job.plane.name]
        noise = job.reference.noise or 0.0
        ours = quickest([line for line in here if line.tool == "luxmap"], target, noise)
        for tool in dict.fromkeys(line.tool for line in here):
            best = quickest([line for line in here if line.tool == tool], target, noise)
            ratio = cpu_ratio = None
            if ours and best:
                ratio, cpu_ratio = best.seconds / ours.seconds, best.cpu_seconds / ours.cpu_seconds
            found.append(Verdict(job.plane.name, tool, best, ratio, cpu_ratio))
    return found


# --- output ----------------------------------------------------------------------------------------------------------


def table(rows: list[list[str]]) -> str:
    """Columns side by side; the first three to the left, numbers to the right."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    pads = [str.ljust if column < 3 else str.rjust for column in range(len(widths))]
    lines = ("  ".join(pad(cell, width) for pad, cell, width in zip(pads, row, widths)) for row in rows)
    return "\n".join(line.rstrip() for line in lines)


def medians_table(lines: list[Line]) -> str:
    rows = [["plane", "tool", "setting", "turns", "seconds", "CPU s", "RMSE %", "bias %"]]
    for line in lines:
        times = [f"{line.turns}", f"{line.seconds:.2f}", f"{line.cpu_seconds:.2f}"]
        errors = [f"{line.rmse_percent:.2f}", f"{line.bias_percent:+.2f}"]
        rows.append([line.plane, line.tool, line.setting, *times, *errors])
    return table(rows)


def verdicts_table(found: list[Verdict], lines: list[Line], target: float) -> str:
    rows = [["plane", "tool", f"quickest to reach {target:g} %", "seconds", "/ luxmap", "CPU / luxmap", ""]]
    for verdict in found:
        if verdict.line is None:
            own = [line for line in lines if (line.plane, line.tool) == (verdict.plane, verdict.tool)]
            best = min(own, key=lambda line: line.rmse_percent)
            setting = f"none; nearest {best.rmse_percent:.2f} %: {best.setting}"
            rows.append([verdict.plane, verdict.tool, setting, f"({best.seconds:.2f})", "–", "–", ""])
            continue
        ratios = [f"{ratio:.2f}" if ratio else "–" for ratio in (verdict.ratio, verdict.cpu_ratio)]
        mark = "extrapolated by 1/√N" if verdict.line.extrapolated else ""
        rows.append([verdict.plane, verdict.tool, verdict.line.setting, f"{verdict.line.seconds:.2f}", *ratios, mark])
    return table(rows)


def conditions(arguments: argparse.Namespace, llvm: str) -> dict[str, Any]:
    """Where, when and with what this was measured."""
    command = [str(PROJECT / "target/release/luxmap"), "--version"]
    luxmap = subprocess.run(command, capture_output=True, text=True, check=True)
    return {
        "date": datetime.datetime.now().astimezone().isoformat(timespec="seconds"),
        "cpu": maps.cpu_model(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "threads": arguments.threads,
        "scene": arguments.scene.name,
        "luxmap": f"{luxmap.stdout.split()[-1]} ({maps.commit()})",
        "radiance": f"{radiance.version()} (pyradiance {environment.PINNED['pyradiance']})",
        "mitsuba": f"{environment.PINNED['mitsuba']}, LLVM {llvm}",
        "radiance_settings": [dataclasses.asdict(setting) for setting in RADIANCE],
    }


def save(path: Path, text: str) -> None:
    temporary = path.with_name(path.name + ".tmp")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(path)


def save_csv(path: Path, runs: list[Run], about: dict[str, Any]) -> None:
    """One line a run, with date, machine and version in each."""
    out = io.StringIO()
    names = [field.name for field in dataclasses.fields(Run)]
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*names, "date", "cpu", "cores", "threads", "luxmap", "radiance", "mitsuba"])
    for run in runs:
        fixed = [about[key] for key in ("date", "cpu", "cores", "threads", "luxmap", "radiance", "mitsuba")]
        writer.writerow([*dataclasses.astuple(run), *fixed])
    save(path, out.getvalue())


# --- main ------------------------------------------------------------------------------------------------------------


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--scene", type=Path, default=PROJECT / "scenes/seed-office.toml", help="scene file [seed-office.toml]")
    add("--plane", action="append", default=[], metavar="NAME", help="measuring plane; repeatable [all]")
    add("--reference", action="append", type=Path, default=[], metavar="FILE",
        help="converged map of each plane, CSV or EXR, in their order [tests/reference/SCENE.PLANE.csv]")  # fmt: skip
    add("--target", type=float, default=1.0, metavar="PCT", help="RMSE to reach, %% of the mean [1]")
    add("--repeats", type=int, default=3, metavar="N", help="turns [3]")
    add("--budget", type=float, default=float("inf"), metavar="SECONDS", help="no turn that would end later [none]")
    add("--threads", type=int, default=2, metavar="N", help="threads of every tool [2]")
    add("--tool", action="append", choices=["radiance", "mitsuba"], help="only this rival; repeatable [both]")
    add("--no-build", action="store_true", help="take target/release/luxmap as it is")
    add("--csv", type=Path, metavar="FILE", help="write every run")
    add("--json", type=Path, metavar="FILE", help="write everything")
    return parser.parse_args()


def make_job(plane: Plane, reference: maps.Reference, points: np.ndarray, folder: Path) -> Job:
    folder.mkdir(parents=True, exist_ok=True)
    np.save(folder / "points.npy", points)
    return Job(plane, reference, points, folder)


def make_jobs(scene: Scene, arguments: argparse.Namespace, folder: Path) -> list[Job]:
    names = arguments.plane or [plane.name for plane in scene.planes]
    defaults = [PROJECT / "tests/reference" / f"{arguments.scene.stem}.{name}.csv" for name in names]
    references = arguments.reference or defaults
    if len(references) != len(names):
        sys.exit(f"rivals: found {len(references)} references, expected one for each of {', '.join(names)}")
    jobs = []
    for number, (name, path) in enumerate(zip(names, references)):
        plane = scene.plane(name)
        reference = maps.read_reference(path, plane)
        points = (plane.points + plane.normal * scene.clearance)[reference.is_place]
        rows = np.hstack([points, np.tile(plane.normal, (len(points), 1))])
        jobs.append(make_job(plane, reference, rows, folder / f"{number}"))
    return jobs


def main() -> int:
    arguments = parse()
    rivals = arguments.tool or ["radiance", "mitsuba"]
    if not arguments.no_build:
        subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=PROJECT, check=True)
    folder = HOME / "work" / arguments.scene.stem
    try:
        scene = load(arguments.scene)
        jobs = make_jobs(scene, arguments, folder)
    except (Unsupported, OSError) as why:
        sys.exit(f"rivals: {arguments.scene}: {why}")

    contenders, checks, llvm = luxmap_contenders(arguments.scene, arguments.threads), [], "none"
    for rival in rivals:
        try:
            if rival == "radiance":
                made = radiance_contenders(scene, arguments.threads, folder, [RADIANCE_CHECK, *RADIANCE])
            else:
                variables, llvm = environment.llvm()
                samples = [MITSUBA_CHECK, *MITSUBA_SAMPLES]
                made = mitsuba_contenders(scene, arguments.threads, folder, variables, samples)
            checks.append(made[0])
            contenders += made[1:]
        except Unsupported as why:
            say(f"{rival} left out: {arguments.scene}: can't convert {why}")

    about = conditions(arguments, llvm)
    for key, value in about.items():
        if isinstance(value, (str, int)):
            print(f"{key:9} {value}")
    for job in jobs:
        noise = "unknown" if job.reference.noise is None else f"{job.reference.noise:.2f} %"
        means = f"mean {job.reference.mean:.2f} lx at {len(job.points)} places, own noise {noise}"
        print(f"reference {job.plane.name}: {means}", flush=True)
    agree = all([check(contender, jobs) for contender in checks])

    load_before = os.getloadavg()[0]
    runs = take_turns(contenders, jobs, arguments.repeats, arguments.budget)
    about["load"] = [round(load_before, 1), round(os.getloadavg()[0], 1)]
    lines = medians(runs, contenders, jobs)
    found = verdicts(lines, jobs, arguments.target)
    print(f"load      {about['load'][0]} before, {about['load'][1]} after")
    print(f"\n{medians_table(lines)}\n\n{verdicts_table(found, lines, arguments.target)}")

    if arguments.csv:
        save_csv(arguments.csv, runs, about)
    if arguments.json:
        everything: dict[str, Any] = {"conditions": about, "target_percent": arguments.target, "agree": agree}
        for key, rows in (("runs", runs), ("medians", lines), ("verdicts", found)):
            everything[key] = [dataclasses.asdict(row) for row in rows]
        save(arguments.json, json.dumps(everything, indent=1, ensure_ascii=False) + "\n")
    return int(not agree)


if __name__ == "__main__":
    sys.exit(main())

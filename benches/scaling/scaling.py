#!/usr/bin/env python3
"""How luxmap's time and memory grow with triangles, luminaires, photons and points.

    cargo build --release && python3 benches/scaling/scaling.py

writes scaling.csv and scaling.svg beside this file and prints the tables as Markdown; --draw does so from the CSV
that is there, --only SERIES measures one series anew. Offices go to a temporary folder: 1.5 GB. Python's own library only.
"""

import argparse
import csv
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
STAGES = {
    "load": ["load scene"],
    "bvh": ["build BVH"],
    "direct": ["direct light"],
    "trace": ["trace photons"],
    "gather": ["gather rays"],
    "smooth": ["smooth"],
}
TIMES = [*STAGES, "rest", "whole", "cpu"]
COLUMNS = ["series", "triangles", "luminaires", "photons", "points", *(f"{t}_s" for t in TIMES), "memory_gb",
           "load_average"]
# What each series varies; everything else stays at BASE.
BASE = {"office": (330, 4_200_000), "luminaires": 30, "photons": 1_000_000, "points": 13_000}
SERIES = {
    # The floor is that of 36 workstations, but for the smallest, which needs that of 6.
    "triangles": [{"office": (6, 10_000)}]
    + [{"office": (36, n)} for n in (100_000, 300_000, 1_000_000, 5_000_000, 20_000_000)],
    "luminaires": [{"luminaires": n} for n in (10, 30, 100, 300, 1000)],
    "photons": [{"photons": n} for n in (100_000, 300_000, 1_000_000, 3_000_000, 10_000_000, 30_000_000)],
    "points": [{"points": n} for n in (10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000)],
}
FLUX_PER_AREA = 800.0  # lm/m²
HEIGHT = 2.70  # of the luminaires, m: below the office's own, which stay as dark furniture


def divided(count, width, depth):
    """Columns and rows of a grid of about so many nearly square cells."""
    columns = max(1, round(math.sqrt(count * width / depth)))
    return columns, max(1, round(count / columns))


def variant(folder, luminaires, points):
    """The office's scene with other luminaires, in one even array, and other cells on the floor; returns its file."""
    text = (folder / "office.toml").read_text()
    floor = re.search(r'name = "floor"\ncorner = .*\nalong = \[([\d.]+),.*\nacross = \[0, ([\d.]+),.*\n', text)
    width, depth = (float(side) for side in floor.groups())
    columns, rows = divided(luminaires, width, depth)
    step = (width / columns, depth / rows)
    flux = FLUX_PER_AREA * width * depth / (columns * rows)
    array = (f'[[luminaire]]\nname = "L"\nposition = [{step[0] / 2}, {step[1] / 2}, {HEIGHT}]\n'
             f"opening = {{ rectangle = [0.3, 0.3] }}\nflux = {flux}\n"
             f"array = {{ count = [{columns}, {rows}], pitch = [{step[0]}, {step[1]}] }}\n\n")
    cells = list(divided(points, width, depth))
    rest = re.sub(r"cells = .*", f"cells = {cells}", text[text.index("[[plane]]"):], count=1)
    file = folder / "variant.toml"
    file.write_text(text[:text.index("[[luminaire]]")] + array + rest)
    return file


def run(luxmap, folder, case):
    """One pass over one variant: what it took; nothing if it failed."""
    load_average = os.getloadavg()[0]
    scene = variant(folder, case["luminaires"], case["points"])
    out = folder / "out"
    command = [luxmap, "render", scene, "--plane", "floor", "--method", "gather", "--passes", "1", "--photons",
               str(case["photons"]), "--quiet", "--output", out]
    started = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    whole = time.monotonic() - started
    if status != 0:
        print(f"left out, since it failed: {' '.join(map(str, command))}", file=sys.stderr)
        return None
    summary = json.loads((out / "summary.json").read_text())
    seconds = {stage["name"]: stage["seconds"] for stage in summary["stages"]}
    row = {f"{name}_s": sum(seconds.get(stage, 0.0) for stage in stages) for name, stages in STAGES.items()}
    row["rest_s"] = whole - sum(row.values())
    columns, rows = summary["planes"][0]["cells"]
    row |= {"triangles": summary["triangles"], "luminaires": summary["luminaires"], "points": columns * rows,
            "photons": summary["photons_emitted"], "whole_s": whole, "cpu_s": usage.ru_utime + usage.ru_stime,
            "memory_gb": usage.ru_maxrss * 1024 / 1e9, "load_average": load_average}
    return row


def measure(luxmap, chosen):
    """Every run is in the CSV as soon as it is done; series not chosen stay there as they are."""
    file = HERE / "scaling.csv"
    kept = [row for series, rows in (read() if file.exists() else {}).items() if series not in chosen for row in rows]
    rows, made = [], {}
    with tempfile.TemporaryDirectory(prefix="luxmap-scaling-") as temporary:
        for series in chosen:
            for change in SERIES[series]:
                case = BASE | change
                if case["office"] not in made:
                    workstations, triangles = case["office"]
                    folder = pathlib.Path(temporary) / f"{workstations}-{triangles}"
                    subprocess.run([luxmap, "office", "--workstations", str(workstations), "--triangles", str(triangles),
                                    "--windows", "matte", "-o", folder], check=True, stdout=subprocess.DEVNULL)
                    made[case["office"]] = folder
                row = run(luxmap, made[case["office"]], case)
                if row is None:
                    continue
                rows.append({"series": series} | row)
                print(", ".join(f"{key} {shown(value)}" for key, value in rows[-1].items()), file=sys.stderr)
                write(sorted(kept + rows, key=lambda row: list(SERIES).index(row["series"])))


def write(rows):
    with open(HERE / "scaling.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        exact = {"series", "triangles", "luminaires", "photons", "points"}
        writer.writerows({key: value if key == "series" else f"{value:.0f}" if key in exact else f"{value:.4g}"
                          for key, value in row.items()} for row in rows)


def read():
    with open(HERE / "scaling.csv", newline="") as file:
        rows = [{key: value if key == "series" else float(value) for key, value in row.items()}
                for row in csv.DictReader(file)]
    return {series: [row for row in rows if row["series"] == series] for series in dict.fromkeys(r["series"] for r in rows)}


def exponent(rows, x, y):
    """Slope of log y over log x, by least squares over the upper half of the rows; nothing where y is too small to time."""
    upper = rows[(len(rows) - 1) // 2:]
    if min(row[y] for row in upper) < 0.01:
        return None
    xs, ys = ([math.log(row[name]) for row in upper] for name in (x, y))
    mean_x, mean_y = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((a - mean_x) * (b - mean_y) for a, b in zip(xs, ys)) / sum((a - mean_x) ** 2 for a in xs)


def shown(value):
    if isinstance(value, str):
        return value
    return f"{value:,.0f}".replace(",", " ") if value >= 1000 else f"{value:.3g}"


def table(series, rows):
    columns = [series, *(f"{name}_s" for name in TIMES), "memory_gb", "load_average"]
    heads = [series, *(f"{name}, s" for name in TIMES), "memory, GB", "load average"]
    lines = ["| " + " | ".join(heads) + " |", "|" + "--:|" * len(heads)]
    lines += ["| " + " | ".join(shown(row[column]) for column in columns) + " |" for row in rows]
    slopes = [exponent(rows, series, column) for column in columns[1:-1]]
    texts = ["–" if slope is None else f"{slope:.2f}".replace("-", "−") for slope in slopes]
    return "\n".join([*lines, "| **exponent** | " + " | ".join(f"**{text}**" for text in texts) + " | |"])


COLOURS = {"load": "#8c6bb1", "bvh": "#3f7fbf", "direct": "#d95f0e", "trace": "#238b45", "gather": "#c51b7d",
           "smooth": "#8a8a00", "whole": "#222222", "memory": "#888888"}
WIDTH, HEIGHT_PX, LEFT, RIGHT, TOP, BOTTOM = 400, 270, 46, 62, 26, 36


def panel(series, rows):
    """One chart, log–log: seconds, and gigabytes dashed."""
    lines = {name: f"{name}_s" for name in [*STAGES, "whole"]} | {"memory": "memory_gb"}
    xs = [row[series] for row in rows]
    ys = [max(row[column], 1e-3) for column in lines.values() for row in rows]
    ends = [(math.floor(math.log10(min(v)) * 2) / 2, math.ceil(math.log10(max(v)) * 2) / 2) for v in (xs, ys)]

    def place(x, y):
        share = [(math.log10(max(v, 1e-3)) - low) / (high - low) for v, (low, high) in zip((x, y), ends)]
        return LEFT + share[0] * (WIDTH - LEFT - RIGHT), TOP + (1 - share[1]) * (HEIGHT_PX - TOP - BOTTOM)

    svg = [f'<text x="{LEFT}" y="15" class="title">{series}</text>']
    for axis, (low, high) in enumerate(ends):
        for decade in range(math.ceil(low), math.floor(high) + 1):
            x, y = place(10.0 ** (decade if axis == 0 else ends[0][0]), 10.0 ** (decade if axis == 1 else ends[1][0]))
            if axis == 0:
                svg.append(f'<path class="grid" d="M{x:.1f},{TOP}V{HEIGHT_PX - BOTTOM}"/><text x="{x:.1f}" '
                           f'y="{HEIGHT_PX - BOTTOM + 15}" text-anchor="middle">10<tspan dy="-4" font-size="8">{decade}'
                           "</tspan></text>")
            else:
                svg.append(f'<path class="grid" d="M{LEFT},{y:.1f}H{WIDTH - RIGHT}"/><text x="{LEFT - 5}" '
                           f'y="{y + 4:.1f}" text-anchor="end">{10.0 ** decade:g}</text>')
    names = []
    for name, column in lines.items():
        points = [place(row[series], row[column]) for row in rows]
        dash = ' stroke-dasharray="4 3"' if name == "memory" else ""
        width = 2.2 if name == "whole" else 1.4
        path = "L".join(f"{x:.1f},{y:.1f}" for x, y in points)
        svg.append(f'<path d="M{path}" fill="none" stroke="{COLOURS[name]}" stroke-width="{width}"{dash}/>')
        svg += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2" fill="{COLOURS[name]}"/>' for x, y in points]
        names.append([points[-1][1], name])
    names.sort()
    for above, below in zip(names, names[1:]):
        below[0] = max(below[0], above[0] + 12)
    beyond = max(0, names[-1][0] - (HEIGHT_PX - 6))
    svg += [f'<text x="{WIDTH - RIGHT + 6}" y="{y - beyond + 4:.1f}" fill="{COLOURS[name]}">{name}</text>'
            for y, name in names]
    return "\n".join(svg)


def draw(all_series):
    count = len(all_series)
    rows = (count + 1) // 2
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {2 * WIDTH} {rows * HEIGHT_PX + 20}" '
             'font-family="sans-serif" font-size="11"><title>Time and memory of luxmap against the size of the task</title>'
             "<style>.grid{stroke:#ddd}.title{font-size:13px;font-weight:bold}</style>"
             f'<rect width="{2 * WIDTH}" height="{rows * HEIGHT_PX + 20}" fill="#fff"/>']
    for index, (series, values) in enumerate(all_series.items()):
        x, y = index % 2 * WIDTH, index // 2 * HEIGHT_PX
        parts.append(f'<g transform="translate({x} {y})">\n{panel(series, values)}\n</g>')
    parts.append(f'<text x="{LEFT}" y="{rows * HEIGHT_PX + 10}">seconds by the clock; memory (dashed): peak, GB</text></svg>')
    (HERE / "scaling.svg").write_text("\n".join(parts) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--luxmap", default=HERE.parents[1] / "target/release/luxmap", help="the command")
    parser.add_argument("--draw", action="store_true", help="measure nothing: tables and plot of the CSV that is there")
    parser.add_argument("--only", choices=SERIES, action="append", help="only this series; the others stay as they are")
    arguments = parser.parse_args()
    if not arguments.draw:
        measure(arguments.luxmap, arguments.only or list(SERIES))
    all_series = read()
    draw(all_series)
    for series, rows in all_series.items():
        print(f"\n### {series.capitalize()}\n\n{table(series, rows)}")


if __name__ == "__main__":
    main()

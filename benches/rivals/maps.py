"""Maps of illuminance and how far they are from a reference."""

from __future__ import annotations

import csv
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scene import REC709, Plane


@dataclass(frozen=True)
class Reference:
    """E at the centres of a plane's cells, row by row from the corner, lx; NaN where there is no place."""

    illuminance: np.ndarray
    standard_error: np.ndarray | None

    @property
    def is_place(self) -> np.ndarray:
        return np.isfinite(self.illuminance)

    @property
    def mean(self) -> float:
        return float(self.illuminance[self.is_place].mean())

    @property
    def noise(self) -> float | None:
        """Its own standard error, root mean square, % of its mean."""
        if self.standard_error is None:
            return None
        return 100 * float(np.sqrt(np.mean(self.standard_error[self.is_place] ** 2))) / self.mean


@dataclass(frozen=True)
class Score:
    """Distance of a map from the reference, % of the reference's mean."""

    rmse: float
    bias: float


def read_csv(path: Path) -> Reference:
    """A CSV with a column E_lx, empty or `nan` where there is no place, as luxmap writes it."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    if not rows or "E_lx" not in rows[0]:
        sys.exit(f"rivals: {path}: found no column E_lx, expected a map as luxmap writes it")
    column = {key: np.array([float(row.get(key) or "nan") for row in rows]) for key in ("E_lx", "standard_error_lx")}
    error = column["standard_error_lx"]
    return Reference(column["E_lx"], error if np.isfinite(error).any() else None)


def read_exr(path: Path) -> Reference:
    """An EXR with Y, or R G B, in lx and A = 0 where there is no place; its first row is the far end of the plane."""
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    bitmap = mitsuba.Bitmap(str(path))
    names = [field.name for field in bitmap.struct_()]
    pixels = np.array(bitmap, float).reshape(bitmap.height(), bitmap.width(), -1)[::-1]
    layer = {name: pixels[..., index].ravel() for index, name in enumerate(names)}
    found = layer["Y"] if "Y" in layer else np.stack([layer[name] for name in "RGB"], axis=1) @ REC709
    return Reference(np.where(layer.get("A", 1) == 0, np.nan, found), layer.get("stderr.Y"))


def read_reference(path: Path, plane: Plane) -> Reference:
    if not path.is_file():
        sys.exit(f"rivals: no reference {path}; give one with --reference FILE (CSV or EXR, as luxmap writes them)")
    reference = read_exr(path) if path.suffix == ".exr" else read_csv(path)
    cells = plane.cells[0] * plane.cells[1]
    if len(reference.illuminance) != cells:
        sys.exit(f"rivals: {path}: found {len(reference.illuminance)} values, expected {cells} of plane {plane.name}")
    return reference


def score(found: np.ndarray, reference: Reference) -> Score:
    """`found` at the reference's places only; a value missing there counts as 0."""
    wanted = reference.illuminance[reference.is_place]
    difference = np.nan_to_num(found) - wanted
    rmse = float(np.sqrt(np.mean(difference**2)))
    return Score(100 * rmse / reference.mean, 100 * float(difference.mean()) / reference.mean)


def cpu_model() -> str:
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        return next((line.split(":", 1)[1].strip() for line in file if line.startswith("model name")), "unknown")


def commit() -> str:
    """The project's commit, with a + if files differ from it."""
    described = subprocess.run(
        ["git", "describe", "--always", "--dirty=+"],
        cwd=Path(__file__).parent, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return described.stdout.strip() or "unknown"

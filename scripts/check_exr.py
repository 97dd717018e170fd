"""Reads the EXR files of a result folder with OpenEXR's own library and compares them with the CSV files beside them.

Needs PyPI's OpenEXR and numpy; `make check-exr` sets them up. Exit code 1 if a pixel differs by more than rounding.
"""

import csv
import pathlib
import sys

import numpy as np
import OpenEXR

REC709 = np.array([0.2126, 0.7152, 0.0722])


def illuminance(image):
    """E in lx, first row nearest to the plane's corner, as the CSV has it."""
    channels = {name: channel.pixels for name, channel in image.channels().items()}
    values = channels["Y"] if "Y" in channels else next(channels[n] for n in ("RGB", "RGBA") if n in channels)[..., :3] @ REC709
    return np.flipud(values).ravel()


def check(file):
    """Compares one EXR file with its CSV; returns the largest relative difference."""
    image = OpenEXR.File(str(file))
    found = illuminance(image)
    with open(file.with_suffix(".csv"), newline="") as rows:
        expected = np.array([float(row["E_lx"] or 0) for row in csv.DictReader(rows)])
    assert len(image.parts) == 1 and image.header()["unit"] == "lx", file
    assert found.shape == expected.shape and np.isfinite(found).all(), file
    return np.max(np.abs(found - expected) / np.maximum(expected, 1e-9 + 1e-3 * expected.max()))


worst = {file.name: check(file) for file in sorted(pathlib.Path(sys.argv[1]).glob("*.exr"))}
for name, difference in worst.items():
    print(f"{name}: differs from its CSV by {difference:.1e} at most")
sys.exit(int(not worst or max(worst.values()) > 1e-5))  # the CSV has six significant digits

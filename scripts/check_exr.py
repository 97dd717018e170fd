"""Reads the EXR files of result folders with OpenEXR's own library: maps are compared with the CSV files beside them,
images of cameras with themselves (parts of the light add up, depths and positions agree).

Needs PyPI's OpenEXR and numpy; `make check-exr` sets them up. Where OpenEXR's programs exrheader, exrinfo and exrcheck are
installed, they have to read every file too. Exit code 1 if anything differs by more than rounding.
"""

import csv
import pathlib
import shutil
import subprocess
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


def check_camera(file):
    """Checks the layers of a camera's image against each other; returns the largest relative difference."""
    image = OpenEXR.File(str(file), separate_channels=True)
    header = image.header()
    layers = {name: channel.pixels.astype(np.float64) for name, channel in image.channels().items()}
    lights = ["Y"] if "Y" in layers else ["R", "G", "B"]
    light = lambda layer: np.stack([layers[f"{layer}.{c}" if layer else c] for c in lights])
    point = lambda name: np.stack([layers[f"{name}.{axis}"] for axis in "XYZ"])
    vector = lambda name: np.array([float(number) for number in header[name].split()])
    size = image.parts[0].height(), image.parts[0].width()
    low, high = header["dataWindow"]
    assert len(image.parts) == 1 and all(np.isfinite(values).all() for values in layers.values()), file
    assert (tuple(low), tuple(high)) == ((0, 0), (size[1] - 1, size[0] - 1)), file
    assert all(np.array_equal(a, b) for a, b in zip(header["dataWindow"], header["displayWindow"])), file
    assert header["pixelAspectRatio"] == 1 and "chromaticities" in header, file
    assert all(layers[f"{layer}.{c}"].shape == size for layer in ("albedo", "luminance") for c in lights), file
    covered, seen = layers["A"], layers["Z"] < 1e9
    assert ((0 <= covered) & (covered <= 1)).all() and (light("albedo") <= 1 + 1e-6).all(), file
    assert (np.linalg.norm(point("N"), axis=0) <= covered + 1e-5).all() and (layers["stderr.Y"] >= 0).all(), file
    whole = light("")
    parts = np.max(np.abs(whole - light("direct") - light("indirect")) / np.maximum(whole, 1e-9 + 1e-3 * whole.max()))
    world = point("P") + vector("positionOrigin")[:, None, None]
    depth = np.tensordot(vector("forward"), world - vector("eye")[:, None, None], axes=1)
    scale = np.abs(world[:, seen]).max() if seen.any() else 1
    return max(parts, np.max(np.abs(depth - layers["Z"])[seen] / scale, initial=0))


def check_with_programs(file):
    """Lets OpenEXR's own programs read a file; returns the names of those that are installed."""
    programs = [program for program in ("exrheader", "exrinfo", "exrcheck") if shutil.which(program)]
    for program in programs:
        subprocess.run([program, str(file)], check=True, stdout=subprocess.DEVNULL)
    return programs


worst = {}
for file in sorted(file for folder in sys.argv[1:] for file in pathlib.Path(folder).glob("*.exr")):
    camera = "camera" in OpenEXR.File(str(file)).header()
    worst[file] = check_camera(file) if camera else check(file)
    programs = ", ".join(["OpenEXR"] + check_with_programs(file))
    print(f"{file.name}: differs from {'itself' if camera else 'its CSV'} by {worst[file]:.1e} at most; read by {programs}")
sys.exit(int(not worst or max(worst.values()) > 1e-5))  # the CSV has six significant digits

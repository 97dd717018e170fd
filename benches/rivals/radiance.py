"""luxmap's scenes for Radiance, and Radiance's own way to E: `oconv`, `mkpmap`, `rtrace -I+`.

Radiances are written as luminance / 179, Radiance's luminous efficacy, so lux = 179 × irradiance.
"""

from __future__ import annotations

import os
import subprocess
import sysconfig
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scene import Luminaire, Material, Scene, Unsupported

EFFICACY = 179.0
"""lm/W, by Radiance's convention."""

POINT_RADIUS = 1e-3
"""Radius of the sphere or disc that stands for a point, m."""

CAUSTICS = "100000"
"""Photons of light by way of glass, where a setting has no photon map."""

PACKAGE = Path(sysconfig.get_path("platlib")) / "pyradiance"
ENVIRONMENT = {**os.environ, "RAYPATH": str(PACKAGE / "lib")}


@dataclass(frozen=True)
class Setting:
    """How Radiance is asked: options of mkpmap (none: no photon map) and of rtrace."""

    name: str
    mkpmap: str | None
    rtrace: str


def tool(name: str) -> str:
    return str(PACKAGE / "bin" / name)


def version() -> str:
    """As Radiance itself tells it."""
    found = subprocess.run([tool("rtrace"), "-version"], env=ENVIRONMENT, capture_output=True, text=True, check=True)
    return found.stdout.strip()


# --- the scene -------------------------------------------------------------------------------------------------------


def write(scene: Scene, folder: Path) -> Path:
    """Writes the scene into `folder`; the path of its .rad file."""
    path = folder / "scene.rad"
    path.write_text("\n".join(primitives(scene, folder.resolve())) + "\n")
    return path


def primitives(scene: Scene, folder: Path) -> Iterator[str]:
    yield f"# {scene.name}"
    for number, (name, faces) in enumerate(scene.faces.items()):
        yield f"# {name}"
        yield surface(f"m{number}", scene.materials[name])
        for index, face in enumerate(faces):
            for part, corners in enumerate(planar(scene.vertices[face])):
                yield primitive(f"m{number}", "polygon", f"f{number}.{index}.{part}", corners.ravel())
    for number, luminaire in enumerate(scene.luminaires):
        yield f"# {luminaire.name}"
        if luminaire.photometry:
            yield measured(number, luminaire, folder)
        else:
            yield from opening(number, luminaire)


def primitive(modifier: str, kind: str, name: str, numbers: np.ndarray) -> str:
    values = " ".join(f"{number:.12g}" for number in numbers)
    return f"{modifier} {kind} {name} 0 0 {len(numbers)} {values}"


def surface(name: str, material: Material) -> str:
    if material.shines:
        if material.reflectance.any() or material.mirrors:
            raise Unsupported(f"material {material.name}: shines and reflects; Radiance's light does not reflect")
        return primitive("void", "light", name, material.luminance / EFFICACY)
    if material.dielectric:
        ior, absorption = material.dielectric
        return primitive("void", "dielectric", name, np.array([*[np.exp(-absorption)] * 3, ior, 0]))
    if material.mirrors:
        if material.reflectance.any():
            raise Unsupported(f"material {material.name}: Lambertian and mirror parts together")
        if material.roughness:
            # Ward's lobe of the same width; its tails are shorter than GGX's.
            return primitive("void", "metal", name, np.append(material.specular, [1, material.roughness]))
        return primitive("void", "mirror", name, material.specular)
    return primitive("void", "plastic", name, np.append(material.reflectance, [0, 0]))


def planar(corners: np.ndarray) -> list[np.ndarray]:
    """A flat polygon as it is, a warped one as a fan of triangles."""
    edges = corners[1:] - corners[0]
    normal = sum(np.cross(edges[i], edges[i + 1]) for i in range(len(edges) - 1))
    off = np.abs(edges @ normal) / max(float(np.linalg.norm(normal)), 1e-30)
    if len(corners) == 3 or off.max() <= 1e-6 * np.abs(edges).max():
        return [corners]
    return [corners[[0, i, i + 1]] for i in range(1, len(corners) - 1)]


def opening(number: int, luminaire: Luminaire) -> Iterator[str]:
    """A black body that emits from its front only: Radiance's `light` is just that."""
    light, name = f"light{number}", f"opening{number}"
    area, radius = luminaire.area, luminaire.radius
    if luminaire.shape == "point":
        radius = POINT_RADIUS
        area = np.pi * radius**2 * (1 if luminaire.lambertian else 4)
    yield primitive("void", "light", light, luminaire.flux / (area * np.pi * EFFICACY))
    if luminaire.shape == "rectangle":
        yield primitive(light, "polygon", name, luminaire.corners.ravel())
    elif luminaire.lambertian:
        yield primitive(light, "ring", name, np.concatenate([luminaire.centre, luminaire.aim, [0, radius]]))
    else:
        yield primitive(light, "sphere", name, np.append(luminaire.centre, radius))


def measured(number: int, luminaire: Luminaire, folder: Path) -> str:
    """ies2rad's own idea of a photometric file, turned and moved to its place."""
    web, name = luminaire.photometry, f"web{number}"
    assert web
    if np.ptp(luminaire.flux):
        raise Unsupported(f"luminaire {luminaire.name}: coloured light from a photometric file")
    if abs(luminaire.aim[2] + 1) > 1e-12:
        raise Unsupported(f"luminaire {luminaire.name}: a photometric file that doesn't look straight down")
    scale = luminaire.flux[0] / web.flux
    make = ["ies2rad", "-dm", "-t", "default", "-m", f"{scale:.9g}", "-o", name, str(web.path.resolve())]
    rotation = np.degrees(np.arctan2(luminaire.width[1], luminaire.width[0]))
    move = ["xform", "-rz", f"{rotation:.9g}", "-t", *(f"{x:.9g}" for x in luminaire.centre), f"./{name}.rad"]
    for command in (make, move):
        words = [tool(command[0]), *command[1:]]
        done = subprocess.run(words, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=True)
    return done.stdout.replace(f"{name}.dat", str(folder / f"{name}.dat"))


# --- the run ---------------------------------------------------------------------------------------------------------


def run(rad: Path, points: np.ndarray, setting: Setting, threads: int, folder: Path) -> np.ndarray:
    """E of each channel at each point (rows of position and normal), lx."""

    def call(command: list[str], standard_input: bytes = b"") -> bytes:
        done = subprocess.run(
            command, cwd=folder, env=ENVIRONMENT, input=standard_input, capture_output=True, check=False
        )
        if done.returncode:
            raise RuntimeError(f"{Path(command[0]).name}: {done.stderr.decode().strip()}")
        return done.stdout

    (folder / "scene.oct").write_bytes(call([tool("oconv"), str(rad)]))
    # Radiance's shadow rays do not pass glass: what does is left to a photon map of its own.
    caustics = ["-apc", "scene.cpm", setting.mkpmap or CAUSTICS] if " dielectric " in rad.read_text() else []
    wanted = (["-apg", "scene.gpm", *setting.mkpmap.split()] if setting.mkpmap else []) + caustics
    maps: list[str] = []
    if wanted:
        call([tool("mkpmap"), "-fo+", *wanted, "-n", str(threads), "scene.oct"])
        maps = [word for name in wanted if name.endswith("pm") for word in ("-ap", name, "50")]
    options = ["-I+", "-h", "-fff", "-n", str(threads), *setting.rtrace.split(), *maps]
    found = call([tool("rtrace"), *options, "scene.oct"], points.astype("<f4").tobytes())
    return np.frombuffer(found, "<f4").reshape(-1, 3).astype(float) * EFFICACY

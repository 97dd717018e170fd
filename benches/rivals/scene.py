"""Reads luxmap's scene files (TOML + OBJ + MTL) into plain lists, for the converters to other tools.

Only what can be set against other tools is read; anything else is refused by name (`Unsupported`), never left out in
silence. luxmap itself checks the file more closely when it renders it.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "in": 0.0254}
REC709 = np.array([0.2126, 0.7152, 0.0722])
"""Photometric share of each channel: lux = channels @ REC709."""


class Unsupported(Exception):
    """The scene holds something that can't be converted."""


@dataclass
class Material:
    """A surface: Lambertian + mirror, or smooth glass; `luminance` (cd/m²) is what its faces send out."""

    name: str
    reflectance: np.ndarray = field(default_factory=lambda: np.zeros(3))
    specular: np.ndarray = field(default_factory=lambda: np.zeros(3))
    roughness: float = 0.0  # GGX α of the mirror part
    dielectric: tuple[float, float] | None = None  # index of refraction, absorption (1/m)
    luminance: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @property
    def shines(self) -> bool:
        return bool(self.luminance.any())

    @property
    def mirrors(self) -> bool:
        return bool(self.specular.any())


@dataclass
class Luminaire:
    """A luminous opening; light leaves along `aim` only (a point without `lambertian`: in all directions alike; a disc
    with `photometry` by its file)."""

    name: str
    shape: str  # "point", "rectangle" or "disc"
    centre: np.ndarray
    aim: np.ndarray
    width: np.ndarray  # from side to side; a disc's radius is half its length
    depth: np.ndarray  # width x depth points along aim
    flux: np.ndarray  # lm of each channel: flux @ REC709 is the luminous flux
    lambertian: bool
    photometry: Photometry | None = None

    @property
    def corners(self) -> np.ndarray:
        """Of a rectangle, counter-clockwise seen from where light goes."""
        u, v = self.width / 2, self.depth / 2
        return self.centre + np.array([-u - v, u - v, u + v, v - u])

    @property
    def radius(self) -> float:
        return float(np.linalg.norm(self.width)) / 2

    @property
    def area(self) -> float:
        sizes = float(np.linalg.norm(self.width) * np.linalg.norm(self.depth))
        return sizes if self.shape == "rectangle" else np.pi * self.radius**2


@dataclass
class Plane:
    """A measuring plane."""

    name: str
    corner: np.ndarray
    along: np.ndarray
    across: np.ndarray
    cells: tuple[int, int]

    @property
    def normal(self) -> np.ndarray:
        normal = np.cross(self.along, self.across)
        return normal / np.linalg.norm(normal)

    @property
    def points(self) -> np.ndarray:
        """Centres of the cells, row by row from the corner, as luxmap's CSV has them."""
        columns, rows = self.cells
        s, t = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
        return self.corner + s.reshape(-1, 1) * self.along + t.reshape(-1, 1) * self.across


@dataclass
class Scene:
    """World coordinates, metres."""

    name: str
    vertices: np.ndarray
    faces: dict[str, list[list[int]]]  # corners of each polygon, by the name of its material
    materials: dict[str, Material]
    luminaires: list[Luminaire]
    planes: list[Plane]
    extent: float  # of the box around all that stands or shines

    @property
    def coloured(self) -> bool:
        rgb = [m.reflectance for m in self.materials.values()] + [m.specular for m in self.materials.values()]
        rgb += [m.luminance for m in self.materials.values()] + [luminaire.flux for luminaire in self.luminaires]
        return any(np.ptp(channels) > 0 for channels in rgb)

    def plane(self, name: str) -> Plane:
        for plane in self.planes:
            if plane.name == name:
                return plane
        raise Unsupported(f'plane "{name}": not in the scene; expected one of {[p.name for p in self.planes]}')

    @property
    def clearance(self) -> float:
        """How far the measuring points are lifted off a surface, so that their rays start in the air, m."""
        return 1e-5 * self.extent


def load(path: Path) -> Scene:
    """Reads a scene file, the meshes and the photometric files it names."""
    with path.open("rb") as file:
        toml = tomllib.load(file)
    vertices: list[np.ndarray] = []
    faces: dict[str, list[list[int]]] = {}
    library: dict[str, dict[str, list[str]]] = {}
    for section in toml.get("mesh", []):
        obj = path.parent / section["file"]
        first = sum(map(len, vertices))
        points, polygons, libraries = read_obj(obj)
        vertices.append(placed(points, section))
        for name, of_name in polygons.items():
            faces.setdefault(name, []).extend([first + corner for corner in face] for face in of_name)
        for file_name in libraries:
            library |= read_mtl(obj.parent / file_name)
    corners = np.concatenate(vertices) if vertices else np.zeros((0, 3))
    for name, of_name in faces.items():
        if not all(is_convex(corners[face]) for face in of_name if len(face) > 3):
            raise Unsupported(f"material {name}: a concave polygon; export triangles")
    materials = {name: material(name, toml.get("material", {}).get(name, {}), library.get(name, {})) for name in faces}
    luminaires = [member for section in toml.get("luminaire", []) for member in spread(section, path.parent)]
    ends = [corners, *(luminaire.corners for luminaire in luminaires)]
    extent = float(np.ptp(np.concatenate(ends), axis=0).max())
    for luminaire in luminaires:
        # As luxmap does: an opening flush with a ceiling would share its plane.
        luminaire.centre = luminaire.centre + luminaire.aim * (0.5e-5 * extent if luminaire.shape != "point" else 0)
    planes = [
        Plane(
            name=plane["name"],
            corner=np.array(plane["corner"], float),
            along=np.array(plane["along"], float),
            across=np.array(plane["across"], float),
            cells=tuple(plane["cells"]),
        )
        for plane in toml.get("plane", [])
    ]
    return Scene(toml.get("name", path.stem), corners, faces, materials, luminaires, planes, extent)


def placed(points: np.ndarray, section: dict[str, Any]) -> np.ndarray:
    """Vertices of a mesh, in the world."""
    points = points * METRES[section.get("unit", "m")]
    if section.get("up", "z") == "y":
        points = np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1)
    angle = np.radians(section.get("rotate_z", 0))
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return points @ turn.T + np.array(section.get("translate", [0, 0, 0]), float)


def is_convex(corners: np.ndarray) -> bool:
    """Whether a polygon turns the same way at every corner, and so is the fan of its triangles."""
    edges = np.roll(corners, -1, axis=0) - corners
    turns = np.cross(edges, np.roll(edges, -1, axis=0))
    return bool((turns @ turns.sum(axis=0) >= -1e-9 * (turns**2).sum()).all())


def read_obj(path: Path) -> tuple[np.ndarray, dict[str, list[list[int]]], list[str]]:
    """Vertices, polygons by material, and the names of MTL files."""
    vertices: list[list[float]] = []
    faces: dict[str, list[list[int]]] = {}
    libraries: list[str] = []
    material = "default"
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        key, rest = (line.split(None, 1) + ["", ""])[:2]
        if key == "v":
            vertices.append([float(number) for number in rest.split()[:3]])
        elif key == "f":
            corners = [int(corner.split("/")[0]) for corner in rest.split()]
            faces.setdefault(material, []).append([c - 1 if c > 0 else len(vertices) + c for c in corners])
        elif key == "usemtl":
            material = rest.strip()
        elif key == "mtllib":
            libraries.append(rest.strip())
    return np.array(vertices, float), faces, libraries


def read_mtl(path: Path) -> dict[str, dict[str, list[str]]]:
    """Parameters of each material, as written."""
    materials: dict[str, dict[str, list[str]]] = {}
    current: dict[str, list[str]] = {}
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        key, *words = line.split() or [""]
        if key == "newmtl":
            current = materials.setdefault(" ".join(words), {})
        elif words:
            current[key] = words
    return materials


def channels(value: Any) -> np.ndarray:
    """A number, or three, as three channels."""
    return np.broadcast_to(np.array(value, float), 3).copy()


def material(name: str, section: dict[str, Any], mtl: dict[str, list[str]]) -> Material:
    """The scene file's word first, then the MTL's."""
    if np.any(channels(section.get("transmittance", 0))):
        raise Unsupported(f"material {name}: transmittance")
    if "map_Kd" in mtl and "reflectance" not in section:
        raise Unsupported(f"material {name}: the texture of its MTL")

    def number(key: str, default: float) -> float:
        return float(mtl[key][-1]) if key in mtl else default

    def triple(key: str) -> np.ndarray:
        return channels([float(word) for word in mtl.get(key, ["0"])[:3]])

    illum = int(number("illum", 1))
    clear = number("d", 1) < 1 or number("Tr", 0) > 0 or triple("Tf").any() or number("Ni", 1) > 1
    made = Material(name, luminance=triple("Ke"), roughness=float(section.get("roughness", 0)))
    if "dielectric" in section:
        made.dielectric = (float(section["dielectric"]["ior"]), float(section["dielectric"].get("absorption", 0)))
    elif not section.keys() & {"reflectance", "specular"} and illum in (4, 6, 7) and clear:
        made.dielectric = (number("Ni", 1), 0.0)
    else:
        made.specular = channels(section["specular"]) if "specular" in section else triple("Ks") * (illum in (3, 5))
        made.reflectance = channels(section["reflectance"]) if "reflectance" in section else triple("Kd")
    return made


def spread(section: dict[str, Any], folder: Path) -> list[Luminaire]:
    """A `[[luminaire]]`, or the members of its array."""
    name, photometry = section["name"], section.get("photometry")
    web = None
    if photometry not in (None, "lambertian", "isotropic"):
        web = read_ies(folder / photometry)
        if "opening" in section:
            raise Unsupported(f"luminaire {name}: another opening than its photometric file's")
    opening = {"disc": web.diameter} if web else section.get("opening", "point")
    shape = opening if isinstance(opening, str) else next(iter(opening))
    sizes = (0.0, 0.0) if shape == "point" else np.broadcast_to(np.array(opening[shape], float), 2)
    aim = np.array(section.get("aim", [0, 0, -1]), float)
    aim /= np.linalg.norm(aim)
    u = c0_direction(aim, section.get("rotation", 0))
    array = section.get("array", {"count": [1, 1], "pitch": [0, 0]})
    lumens = section["flux"] if "flux" in section or not web else web.flux
    flux = lumens * section.get("dimming", 1.0) * colour(section)
    return [
        Luminaire(
            name=name,
            shape=shape,
            centre=np.array(section["position"], float) + [column * array["pitch"][0], row * array["pitch"][1], 0],
            aim=aim,
            width=sizes[0] * u,
            depth=sizes[1] * np.cross(aim, u),
            flux=flux,
            lambertian=shape != "point" or photometry == "lambertian",
            photometry=web,
        )
        for row in range(array["count"][1])
        for column in range(array["count"][0])
        if flux.any()
    ]


@dataclass
class Photometry:
    """An LM-63 file: type C, absolute or not, light downwards from a disc."""

    path: Path
    planes: np.ndarray  # C, degrees, from 0 to 360
    angles: np.ndarray  # γ, degrees
    candela: np.ndarray  # one row a plane
    diameter: float  # m

    @property
    def flux(self) -> float:
        """lm: I is linear between angles and between planes, so this is exact."""
        a, b = np.radians(self.angles[:-1]), np.radians(self.angles[1:])
        first, last = self.candela[:, :-1], self.candela[:, 1:]
        slope = (last - first) / (b - a)
        zones = (first * np.cos(a) - last * np.cos(b) + slope * (np.sin(b) - np.sin(a))).sum(axis=1)
        return float(np.trapezoid(zones, np.radians(self.planes)))


def read_ies(path: Path) -> Photometry:
    """What the bench's own files hold, no more; luxmap reads everything."""
    text = path.read_text(encoding="latin-1")
    head, _, body = text.partition("TILT=NONE")
    words = body.replace(",", " ").split()
    numbers = np.array([float(word) for word in words])
    multiplier, kind, unit = numbers[2], int(numbers[5]), int(numbers[6])
    vertical, horizontal = int(numbers[3]), int(numbers[4])
    width, length, height = numbers[7:10] * (1.0 if unit == 2 else 0.3048)
    if "LM-63" not in head or kind != 1 or width >= 0 or width != length or height != 0:
        raise Unsupported(f"{path.name}: expected LM-63-1995 or later, type C, a disc as opening")
    scale = multiplier * numbers[10] * numbers[11]
    angles, planes = numbers[13 : 13 + vertical], numbers[13 + vertical : 13 + vertical + horizontal]
    candela = scale * numbers[13 + vertical + horizontal :].reshape(horizontal, vertical)
    if angles[-1] > 90:
        raise Unsupported(f"{path.name}: light upwards")
    if horizontal == 1:
        planes, candela = np.array([0.0, 360]), candela[[0, 0]]
    while planes[-1] < 360:  # 90 → 180 → 360 by mirror symmetry
        planes = np.concatenate([planes, 2 * planes[-1] - planes[-2::-1]])
        candela = np.concatenate([candela, candela[-2::-1]])
    return Photometry(path, planes, angles, candela, -width)


def c0_direction(aim: np.ndarray, rotation: float) -> np.ndarray:
    """Where a rectangle's first size runs: +x for one that looks down, tilted the shortest way towards `aim`; positive
    rotations go counter-clockwise seen from behind, so from above for one that looks down."""
    cosine = 1 - aim[2]
    x = np.array([1.0, 0, 0])
    untwisted = x if cosine < 1e-12 else x - (aim + [0, 0, -1]) * (aim[0] / cosine)
    angle = np.radians(-rotation)
    return untwisted * np.cos(angle) + np.cross(aim, untwisted) * np.sin(angle)


def colour(section: dict[str, Any]) -> np.ndarray:
    """Linear Rec. 709 of luminance 1."""
    rgb = black_body(section["cct"]) if "cct" in section else channels(section.get("color", 1))
    return rgb / (rgb @ REC709)


def black_body(kelvin: float) -> np.ndarray:
    """Krystek's approximation (Color Research & Application 10, 1985), as luxmap uses it."""
    t = kelvin
    u = (0.860117757 + 1.54118254e-4 * t + 1.28641212e-7 * t * t) / (1 + 8.42420235e-4 * t + 7.08145163e-7 * t * t)
    v = (0.317398726 + 4.22806245e-5 * t + 4.20481691e-8 * t * t) / (1 - 2.89741816e-5 * t + 1.61456053e-7 * t * t)
    x, y = 3 * u / (2 * u - 8 * v + 4), 2 * v / (2 * u - 8 * v + 4)
    to_rgb = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
    return np.maximum(to_rgb @ [x / y, 1, (1 - x - y) / y], 0)

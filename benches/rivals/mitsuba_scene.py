"""luxmap's scenes for Mitsuba 3: XML, and one PLY mesh a material. Radiances are in cd/m², so E comes in lux."""

from __future__ import annotations

import xml.etree.ElementTree as xml
from pathlib import Path

import numpy as np

from scene import Luminaire, Material, Scene, Unsupported

POINT_RADIUS = 1e-3
"""Radius of the disc that stands for a point with a Lambertian distribution, m."""


def write(scene: Scene, folder: Path) -> Path:
    """Writes the scene into `folder`; the XML's path."""
    top = xml.Element("scene", version="3.0.0")
    # -1: paths end by Russian roulette only.
    xml.SubElement(xml.SubElement(top, "integrator", type="path"), "integer", name="max_depth", value="-1")
    for number, (name, faces) in enumerate(scene.faces.items()):
        material = scene.materials[name]
        write_ply(folder / f"{number}.ply", scene.vertices, faces, name)
        shape = xml.SubElement(top, "shape", type="ply")
        xml.SubElement(shape, "string", name="filename", value=f"{number}.ply")
        xml.SubElement(shape, "boolean", name="face_normals", value="true")
        bsdf(shape, material)
        if material.shines:
            emitter(shape, material.luminance)
    for number, luminaire in enumerate(scene.luminaires):
        add_luminaire(top, luminaire, folder / f"web{number}.npz")
    path = folder / "scene.xml"
    xml.indent(top)
    xml.ElementTree(top).write(path, encoding="utf-8", xml_declaration=True)
    return path


def rgb(parent: xml.Element, name: str, values: np.ndarray) -> None:
    xml.SubElement(parent, "rgb", name=name, value=" ".join(f"{value:.9g}" for value in values))


def bsdf(shape: xml.Element, material: Material) -> None:
    """The material; opaque surfaces have two sides."""
    if material.dielectric:
        ior, absorption = material.dielectric
        if absorption > 0:
            raise Unsupported(
                f"material {material.name}: absorption in glass (Mitsuba's path integrator knows no media)"
            )
        glass = xml.SubElement(shape, "bsdf", type="dielectric")
        xml.SubElement(glass, "float", name="int_ior", value=f"{ior}")
        xml.SubElement(glass, "float", name="ext_ior", value="1")
        return
    if material.mirrors and material.reflectance.any():
        raise Unsupported(f"material {material.name}: Lambertian and mirror parts together")
    both = xml.SubElement(shape, "bsdf", type="twosided")
    if material.mirrors:
        # A conductor of material "none" reflects all; the factor makes it the mirror wanted.
        mirror = xml.SubElement(both, "bsdf", type="roughconductor" if material.roughness else "conductor")
        xml.SubElement(mirror, "string", name="material", value="none")
        if material.roughness:
            xml.SubElement(mirror, "string", name="distribution", value="ggx")
            xml.SubElement(mirror, "float", name="alpha", value=f"{material.roughness}")
        rgb(mirror, "specular_reflectance", material.specular)
    else:
        rgb(xml.SubElement(both, "bsdf", type="diffuse"), "reflectance", material.reflectance)


def emitter(shape: xml.Element, luminance: np.ndarray) -> None:
    rgb(xml.SubElement(shape, "emitter", type="area"), "radiance", luminance)


def add_luminaire(top: xml.Element, luminaire: Luminaire, table: Path) -> None:
    """An opening is a black body that emits from its front, or a point. Measured intensities go to a file beside the XML,
    for the emitter `web` of mitsuba_trace.py."""
    if luminaire.shape == "point" and not luminaire.lambertian:
        point = xml.SubElement(top, "emitter", type="point")
        x, y, z = luminaire.centre
        xml.SubElement(point, "point", name="position", x=f"{x}", y=f"{y}", z=f"{z}")
        rgb(point, "intensity", luminaire.flux / (4 * np.pi))
        return
    half_width, half_depth, area = luminaire.width / 2, luminaire.depth / 2, luminaire.area
    if luminaire.shape == "point":
        side = np.cross(luminaire.aim, [1, 0, 0] if abs(luminaire.aim[0]) < 0.5 else [0, 1, 0])
        half_width = side / np.linalg.norm(side) * POINT_RADIUS
        half_depth = np.cross(luminaire.aim, half_width)
        area = np.pi * POINT_RADIUS**2
    # Mitsuba's rectangle is [-1, 1]² and its disc the unit disc, both looking along +z.
    columns = np.column_stack([half_width, half_depth, luminaire.aim, luminaire.centre])
    matrix = np.vstack([columns, [0, 0, 0, 1]])
    shape = xml.SubElement(top, "shape", type="rectangle" if luminaire.shape == "rectangle" else "disk")
    transform = xml.SubElement(shape, "transform", name="to_world")
    xml.SubElement(transform, "matrix", value=" ".join(f"{value:.9g}" for value in matrix.ravel()))
    rgb(xml.SubElement(shape, "bsdf", type="diffuse"), "reflectance", np.zeros(3))
    web = luminaire.photometry
    if not web:
        emitter(shape, luminaire.flux / (area * np.pi))
        return
    c0 = luminaire.width / np.linalg.norm(luminaire.width)
    axes = np.stack([c0, np.cross(c0, luminaire.aim), luminaire.aim])
    np.savez(table, planes=web.planes, angles=web.angles, candela=web.candela, axes=axes)
    measured = xml.SubElement(shape, "emitter", type="web")
    xml.SubElement(measured, "string", name="table", value=str(table))
    rgb(measured, "scale", luminaire.flux / (web.flux * area))


def write_ply(path: Path, vertices: np.ndarray, faces: list[list[int]], material: str) -> None:
    """Triangles (fans of the polygons) of one material."""
    triangles = np.array([[f[0], f[i], f[i + 1]] for f in faces for i in range(1, len(f) - 1)])
    used, numbers = np.unique(triangles, return_inverse=True)
    header = (
        f"ply\nformat binary_little_endian 1.0\ncomment {material}\n"
        f"element vertex {len(used)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, numbers.reshape(-1, 3)
    path.write_bytes(header.encode() + vertices[used].astype("<f4").tobytes() + rows.tobytes())

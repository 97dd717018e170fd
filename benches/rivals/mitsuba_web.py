"""Photometric files for Mitsuba 3, which knows none: an emitter for flat openings. Import it once a variant is set."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np


class Web(mi.Emitter):
    """A flat opening that shines by a photometric file: luminance I(C, γ)/(A cos γ), bilinear as luxmap takes it."""

    def __init__(self, properties: mi.Properties) -> None:
        super().__init__(properties)
        with np.load(properties["table"]) as table:
            self.planes, self.angles = table["planes"], table["angles"]
            self.candela = mi.Float(table["candela"].astype(np.float32).ravel())
            self.axes = [mi.Vector3f(*map(float, axis)) for axis in table["axes"]]
        self.plane_starts, self.angle_starts = mi.Float(self.planes), mi.Float(self.angles)
        self.scale = mi.Color3f(properties["scale"])
        self.m_flags = int(mi.EmitterFlags.Surface)

    def luminance(self, direction: mi.Vector3f, cosine: mi.Float, active: mi.Bool) -> mi.Spectrum:
        """Towards `direction`."""
        x, y, z = (dr.dot(direction, axis) for axis in self.axes)
        gamma = dr.rad2deg(dr.safe_acos(z))
        turn = dr.rad2deg(dr.atan2(y, x))
        turn = dr.select(turn < 0, turn + 360, turn)
        active &= (cosine > 1e-6) & (gamma <= float(self.angles[-1]))

        def step(starts: mi.Float, values: np.ndarray, at: mi.Float) -> tuple[mi.UInt32, mi.Float]:
            last = len(values) - 2
            below = dr.binary_search(0, last, lambda i: dr.gather(mi.Float, starts, i + 1) <= at)
            left, right = dr.gather(mi.Float, starts, below), dr.gather(mi.Float, starts, below + 1)
            return below, dr.clip((at - left) / (right - left), 0, 1)

        plane, across = step(self.plane_starts, self.planes, turn)
        angle, along = step(self.angle_starts, self.angles, gamma)
        at = plane * len(self.angles) + angle
        of_plane = [
            dr.lerp(dr.gather(mi.Float, self.candela, at + k, active), dr.gather(mi.Float, self.candela, at + k + 1, active), along)
            for k in (0, len(self.angles))
        ]
        value = dr.select(active, dr.lerp(of_plane[0], of_plane[1], across) / cosine, 0)
        scale = self.scale if dr.size_v(mi.Spectrum) == 3 else mi.luminance(self.scale)
        return mi.Spectrum(scale) * value

    def eval(self, si: mi.SurfaceInteraction3f, active: mi.Bool = True) -> mi.Spectrum:
        return self.luminance(si.to_world(si.wi), mi.Frame3f.cos_theta(si.wi), mi.Bool(active))

    def sample_direction(self, it, sample, active=True):
        ds = self.get_shape().sample_direction(it, sample, active)
        cosine = -dr.dot(ds.d, ds.n)
        active = mi.Bool(active) & (cosine > 0) & (ds.pdf > 0)
        ds.emitter = mi.EmitterPtr(self)
        return ds, dr.select(active, self.luminance(-ds.d, cosine, active) / ds.pdf, 0)

    def pdf_direction(self, it, ds, active=True):
        active = mi.Bool(active) & (dr.dot(ds.d, ds.n) < 0)
        return dr.select(active, self.get_shape().pdf_direction(it, ds, active), 0)

    def eval_direction(self, it, ds, active=True):
        cosine = -dr.dot(ds.d, ds.n)
        return self.luminance(-ds.d, cosine, mi.Bool(active))

    def bbox(self):
        return self.get_shape().bbox()

    def to_string(self) -> str:
        return "Web[]"

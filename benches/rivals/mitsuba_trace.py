"""The process that is timed for Mitsuba 3: load a scene, compute E at given points, write it.

Mitsuba's sensors either see a surface (and no plane in the air) or start rays at a point without sampling emitters
there (`irradiancemeter`, much noisier). So the loop of its path integrator, emitter sampling and BSDF
sampling joined by the balance heuristic, is written here with its own interface and starts at the measuring point as if
a white Lambertian surface lay there. Mitsuba compiles it like its own.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

LARGEST_WAVEFRONT = 1 << 24


def balance(pdf: mi.Float, other: mi.Float) -> mi.Float:
    """Weight of a sample drawn with density `pdf`, where another strategy has `other`."""
    return dr.select(pdf > 0, pdf / (pdf + other), 0)


@dr.syntax
def illuminance(scene: mi.Scene, points: np.ndarray, normal: np.ndarray, samples: int, seed: int) -> np.ndarray:
    """E of each channel at each point, lx, by one wavefront of `samples` paths a point."""
    count = len(points) * samples
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, count)
    context = mi.BSDFContext()

    owner = dr.arange(mi.UInt32, count) // samples
    x, y, z = (mi.Float(np.ascontiguousarray(points[:, axis], np.float32)) for axis in range(3))
    start = dr.zeros(mi.SurfaceInteraction3f, count)
    start.p = mi.Point3f(dr.gather(mi.Float, x, owner), dr.gather(mi.Float, y, owner), dr.gather(mi.Float, z, owner))
    start.n = mi.Normal3f(float(normal[0]), float(normal[1]), float(normal[2]))

    # The first vertex; radiance over π throughout, as a white Lambertian surface would reflect.
    ds, weight = scene.sample_emitter_direction(start, sampler.next_2d(), True)
    pdf_ray = dr.maximum(dr.dot(ds.d, start.n), 0) * dr.inv_pi
    total = weight * pdf_ray * dr.select(ds.delta, 1, balance(ds.pdf, pdf_ray))
    local = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
    ray = mi.Ray3f(start.p, mi.Frame3f(start.n).to_world(local))

    before = mi.Interaction3f(start)
    pdf_ray = mi.warp.square_to_cosine_hemisphere_pdf(local)
    mirrored = mi.Bool(False)
    throughput = mi.Spectrum(1)
    eta = mi.Float(1)
    active = mi.Bool(True)
    while active:
        hit = scene.ray_intersect(ray, mi.RayFlags.All, False, active)
        ds = mi.DirectionSample3f(scene, hit, before)
        pdf_emitter = scene.pdf_emitter_direction(before, ds, active & ~mirrored)
        share = dr.select(mirrored, 1, balance(pdf_ray, pdf_emitter))
        total += throughput * ds.emitter.eval(hit, active) * share
        active &= hit.is_valid()

        bsdf = hit.bsdf()
        smooth = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        ds, weight = scene.sample_emitter_direction(hit, sampler.next_2d(), True, smooth)
        smooth &= ds.pdf > 0
        value, pdf_ray, sample, factor = bsdf.eval_pdf_sample(
            context, hit, hit.to_local(ds.d), sampler.next_1d(), sampler.next_2d(), active
        )
        share = dr.select(ds.delta, 1, balance(ds.pdf, pdf_ray))
        total += dr.select(smooth, throughput * value * weight * share, 0)

        ray = hit.spawn_ray(hit.to_world(sample.wo))
        before = mi.Interaction3f(hit)
        pdf_ray = sample.pdf
        mirrored = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
        throughput *= factor
        eta *= sample.eta

        # Mitsuba's Russian roulette, from the first bounce on: 1.5 times as efficient here as its default, the fifth.
        survival = dr.minimum(dr.max(throughput) * dr.square(eta), 0.95)
        active &= sampler.next_1d() < survival
        throughput *= dr.select(active, dr.rcp(survival), 0)

    return np.stack([np.array(dr.block_sum(channel, samples)) * (np.pi / samples) for channel in total], axis=1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="Mitsuba XML")
    parser.add_argument("points", type=Path, help=".npy, one row of position and normal a point; one normal for all")
    parser.add_argument("output", type=Path, help=".npy, one row of channels a point")
    parser.add_argument("--variant", required=True)
    parser.add_argument("--samples", type=int, required=True, help="paths a point")
    parser.add_argument("--threads", type=int, required=True)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()

    mi.set_variant(arguments.variant)
    import mitsuba_web  # its classes are those of the variant

    mi.register_emitter("web", mitsuba_web.Web)
    dr.set_thread_count(arguments.threads)
    rows = np.load(arguments.points)
    points, normal = rows[:, :3], rows[0, 3:]
    scene = mi.load_file(arguments.scene)

    in_one = max(1, min(arguments.samples, LARGEST_WAVEFRONT // len(points)))
    passes = -(-arguments.samples // in_one)
    found = sum(illuminance(scene, points, normal, in_one, arguments.seed * 65536 + i) for i in range(passes)) / passes
    np.save(arguments.output, found)


if __name__ == "__main__":
    main()

"""Peers that give a total of a slab only: iadpython, mitsuba."""

import numpy as np

from benchmarks.speed.peers.units import SLABS


def iadpython(unit, size):
    """Total reflectance and transmittance at normal incidence."""
    import iadpython as iad

    slab = SLABS[unit]
    asymmetry, albedo, thickness = slab.sets[0]

    def run():
        sample = iad.Sample(a=albedo, b=thickness, g=asymmetry, n=slab.index, quad_pts=size)
        return {"totals": np.array(sample.rt()[:2])}

    return run


def mitsuba_llvm(unit, size):
    """Compiled by LLVM."""
    return _mitsuba("llvm_ad_mono", unit, size)


def mitsuba_scalar(unit, size):
    """One path after the other."""
    return _mitsuba("scalar_rgb", unit, size)


def _mitsuba(variant, unit, size):
    """Total reflectance at normal incidence, by reciprocity: radiance of the slab under a uniform sky."""
    import mitsuba as mi

    mi.set_variant(variant)
    slab = SLABS[unit]
    asymmetry, albedo, thickness = (float(value) for value in slab.sets[0])
    look = mi.ScalarTransform4f().look_at
    medium = {
        "type": "homogeneous",
        "albedo": {"type": "uniform", "value": albedo},
        "sigma_t": {"type": "uniform", "value": thickness},
        "phase": {"type": "hg", "g": asymmetry},
    }
    scene = mi.load_dict(
        {
            "type": "scene",
            # No roulette at the depths that matter: it only adds noise at this albedo.
            "integrator": {"type": "volpath", "max_depth": -1, "rr_depth": 100_000},
            "sensor": {
                "type": "radiancemeter",
                "to_world": look(origin=[0, 0, 3], target=[0, 0, 0], up=[0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 1, "height": 1, "pixel_format": "luminance"},
                "sampler": {"type": "independent"},
            },
            "sky": {
                "type": "rectangle",
                "to_world": look(origin=[0, 0, 5], target=[0, 0, 0], up=[0, 1, 0]).scale([1e5, 1e5, 1]),
                "emitter": {"type": "area", "radiance": {"type": "uniform", "value": 1.0}},
            },
            "slab": {
                "type": "cube",
                "to_world": mi.ScalarTransform4f().scale([1e3, 1e3, 0.5]),
                "bsdf": {"type": "dielectric", "int_ior": slab.index, "ext_ior": 1.0},
                "interior": medium,
            },
        }
    )
    # Parts give the standard error.
    parts = 10
    seeds = iter(range(1, 2**31))

    def run():
        renders = [mi.render(scene, spp=size // parts, seed=next(seeds)) for _ in range(parts)]
        return {"noisy_total": np.array([np.array(render).item() for render in renders])}

    return run

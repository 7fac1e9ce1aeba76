"""One printed dot in Mitsuba and by the paths of `jaxink render`: the light that returns into the plate."""

import numpy as np

from benchmarks.validation.render.plate import N_BATCHES
from jaxink.export.medium import Medium
from jaxink.render.dots import VolumeDots
from jaxink.render.guide import Guide

# Distances from the dot: the sensor's must be more than Mitsuba's single precision steps over.
_SENSOR_MM, _SCREEN_MM, _FAR_MM = 1e-3, 5.0, 200.0


def dot_scene(medium: Medium, radius_mm: float) -> dict:
    """A cylinder of ink below a plate without an upper face, in uniform light from above only.

    The sensor is a disc just above the dot. In uniform light of radiance 1, what it sees is the share of
    diffuse light, uniform over the dot, that returns into the plate.
    """
    import mitsuba as mi

    to = mi.ScalarTransform4f
    plate, around = (float(index) for index in medium.indices[:, 0])
    index, depth = float(medium.refractive_index[0]), medium.thickness_um / 1000
    extinction = float(medium.extinction_per_mm[0])
    # Fine enough for the smooth phase functions that are compared here.
    phase = medium.phase[0](np.linspace(-1.0, 1.0, 4097))

    def step(inside, outside):
        same = abs(inside / outside - 1) < 1e-9
        return {"type": "null"} if same else {"type": "dielectric", "int_ior": inside, "ext_ior": outside}

    ink = mi.load_dict(
        {
            "type": "homogeneous",
            "sigma_t": {"type": "constvolume", "value": extinction},
            "albedo": {"type": "constvolume", "value": float(medium.scattering_per_mm[0]) / extinction},
            "phase": {
                "type": "tabphase",
                "values": ", ".join(f"{v:.9g}" for v in phase),
            },
        }
    )
    dark = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
    wide = to().scale([radius_mm, radius_mm, 1.0])
    over = to().rotate([1, 0, 0], 180) @ wide
    vertices, faces = _around(radius_mm)
    rest = mi.Mesh("rest", len(vertices), len(faces), props=_properties(mi, step(plate, around)))
    parameters = mi.traverse(rest)
    parameters["vertex_positions"] = vertices.ravel().astype(np.float32)
    parameters["faces"] = faces.ravel().astype(np.uint32)
    parameters.update()
    return {
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": -1, "rr_depth": 1_000_000},
        "top": {"type": "disk", "to_world": wide, "bsdf": step(index, plate), "interior": ink},
        "rest": rest,
        "bottom": {
            "type": "disk",
            "to_world": to().translate([0, 0, -depth]) @ over,
            "bsdf": step(index, around),
            "interior": ink,
        },
        "rim": {
            "type": "cylinder",
            "p0": [0, 0, -depth],
            "p1": [0, 0, 0],
            "radius": radius_mm,
            "bsdf": step(index, around),
            "interior": ink,
        },
        "screen": {
            "type": "rectangle",
            "to_world": to().translate([0, 0, -_SCREEN_MM]) @ to().scale([1e4, 1e4, 1]),
            "bsdf": {"type": "twosided", "bsdf": dark},
        },
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}},
        "eye": {
            "type": "disk",
            "to_world": to().translate([0, 0, _SENSOR_MM]) @ over,
            "bsdf": {"type": "null"},
            "sensor": {
                "type": "irradiancemeter",
                "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}},
                "sampler": {"type": "independent"},
            },
        },
    }


def _properties(mi, bsdf: dict):
    given = mi.Properties()
    given["bsdf"] = mi.load_dict(bsdf)
    return given


def _around(radius_mm: float, n: int = 720) -> tuple[np.ndarray, np.ndarray]:
    """The lower face of the plate around the dot as triangles, normal pointing down."""
    angle = 2 * np.pi * np.arange(n) / n
    unit = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    this, following = np.arange(n), np.roll(np.arange(n), -1)
    first = np.stack([this, n + following, n + this], axis=1)
    second = np.stack([this, following, n + following], axis=1)
    return np.concatenate([radius_mm * unit, _FAR_MM * unit]), np.concatenate([first, second])


def by_mitsuba(medium: Medium, radius_mm: float, n_paths: int, seed: int) -> tuple[float, float]:
    """Share that returns, and its standard error from batches."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    loaded = mi.load_dict(dot_scene(medium, radius_mm))
    each = [
        float(np.array(mi.render(loaded, spp=n_paths // N_BATCHES, seed=seed * N_BATCHES + k)).mean()) / np.pi
        for k in range(N_BATCHES)
    ]
    return float(np.mean(each)), float(np.std(each, ddof=1) / N_BATCHES**0.5)


def by_paths(medium: Medium, radius_mm: float, n_paths: int, seed: int) -> tuple[float, float]:
    """The same by the paths of the light guide, in a cell far from other dots."""
    guide = Guide(pitch_mm=100.0, first_radius_mm=radius_mm, last_radius_mm=radius_mm)
    random = np.random.default_rng(seed)
    middle = guide.pitch_mm / 2
    radius, around = radius_mm * np.sqrt(random.random(n_paths)), 2 * np.pi * random.random(n_paths)
    cosine, azimuth = np.sqrt(random.random(n_paths)), 2 * np.pi * random.random(n_paths)
    sine = np.sqrt(1 - cosine**2)
    position = np.stack([middle + radius * np.cos(around), middle + radius * np.sin(around), 0 * radius], 1)
    direction = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), -cosine], axis=1)
    returned = VolumeDots(medium, 0).visit(guide, position, direction, random).goes_on
    share = float(returned.mean())
    return share, float(np.sqrt(share * (1 - share) / n_paths))

"""A print with a plain ink: its sample file, and simulated measurements with effects, coarsely solved."""

import numpy as np

from jaxink.effects import AugmentedModel, Scene
from jaxink.measurement import GonioData
from jaxink.numerics.precision import computing
from jaxink.sample import parse_sample
from jaxink.solver.config import SolverConfig
from tests.samples import PRINTED_INK

# Coarse: the procedure is tested here, and both the data and the fits are made with these sizes.
SIZES = SolverConfig(8, 6, 10, 5)
SAMPLE = f"""{PRINTED_INK}
[masks]
specular_half_angle_deg = 0
undeviated_half_angle_deg = 0
retro_half_angle_deg = 0
"""
TRUE = {"ink.scattering_per_mm": 80.0, "ink.absorption_per_mm": 1.2, "ink.asymmetry_parameter": 0.6}


def columns():
    """Two incidences, both sides, in the plane of incidence, the regular directions left out."""
    theta_i, signed, side = np.meshgrid([10.0, 50.0], np.arange(-80.0, 81.0, 4.0), [0, 1], indexing="ij")
    theta_i, signed, side = theta_i.ravel(), signed.ravel(), side.ravel() > 0
    keep = np.abs(np.abs(signed) - theta_i) > 2.5
    theta_i, signed, side = theta_i[keep], signed[keep], side[keep]
    return theta_i, np.abs(signed), np.where(signed >= 0, 180.0, 0.0), np.full(signed.size, 550.0), side


def drawn(effects, strengths, seed):
    """A simulated measurement with some effects, noise as declared."""
    at, rng = columns(), np.random.default_rng(seed)
    scene = Scene.of(*at, np.arange(at[0].size))
    with computing():
        model = AugmentedModel(parse_sample(SAMPLE), effects, scene, SIZES)
        f = np.asarray(model.bsdf({"ink.thickness_um": 60.0} | TRUE | strengths))
    _, scan = np.unique(np.column_stack([at[0], at[4]]), axis=0, return_inverse=True)
    common = 0.002 * rng.standard_normal(scan.max() + 1)[scan.reshape(-1)]
    noise = np.hypot(0.005 * f, 1e-4) * rng.standard_normal(f.size)
    return GonioData(*at, f * (1 + common) + noise, source="simulated")

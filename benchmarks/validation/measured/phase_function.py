"""What a phase function of any shape leaves of the sintered PTFE; its table stands in measured.md.

python -m benchmarks.validation.measured.phase_function

The loop of diagnosis.py ends where grazing views do not fit. Is that the shape of the phase
function? A spline through free values at nine angles can take nearly any; with the albedo and the index of
the face these are more parameters than a model of the sample may have, so this is a question to the data and
no model of them. An uneven surface by Oren and Nayar is asked for besides.
"""

import json

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

import jaxink
from benchmarks.pages import rms
from benchmarks.validation.measured.diagnosis import SAMPLES, measured
from benchmarks.validation.measured.diagnosis_page import PHASE_STUDY, write
from jaxink.measurement import noise_of, symmetry_repeatability
from jaxink.numerics.precision import computing
from jaxink.optics.directions import Directions
from jaxink.optics.layers import OPAQUE_OPTICAL_THICKNESS, ScatteringLayer
from jaxink.particles.phase_function import TabulatedByAngle, TwoTermHenyeyGreenstein
from jaxink.solver.bsdf import diffuse_bsdf
from jaxink.solver.config import SolverConfig
from jaxink.solver.stack import Stack

ANGLES_DEG = np.array([0.0, 20.0, 40.0, 60.0, 80.0, 105.0, 130.0, 155.0, 180.0])
N_VALUES = ANGLES_DEG.size
# Two lobes as a diagnosis without a surface layer in its catalogue found them, where the search begins.
WEIGHT, ASYMMETRY, SECOND_ASYMMETRY, ALBEDO_LACK, INDEX = 0.09, 0.45, -0.21, 3e-5, 1.02
CONFIG = SolverConfig(24, 16, 24, 16)


def phase_of(ln_values) -> TabulatedByAngle:
    """Phase function through positive values, brought to a mean of 1."""
    cosine, values = np.cos(np.deg2rad(ANGLES_DEG)), jnp.exp(ln_values)
    mean = CubicSpline(cosine[::-1], np.eye(N_VALUES)[::-1]).integrate(-1, 1) / 2 @ values
    return TabulatedByAngle(cosine, values / mean)


def two_lobes() -> np.ndarray:
    """Logarithm of the values of the two lobes."""
    lobes = TwoTermHenyeyGreenstein(ASYMMETRY, SECOND_ASYMMETRY, WEIGHT)
    return np.log(np.asarray(lobes.value(np.cos(np.deg2rad(ANGLES_DEG)))))


def oren_nayar(variance, theta_i, theta_o, phi):
    """BRDF of an uneven matt surface over that of an even one (Oren, Nayar 1994, their simplified model)."""
    level = 1 - 0.5 * variance / (variance + 0.33)
    slope = 0.45 * variance / (variance + 0.09)
    steep, flat = np.maximum(theta_i, theta_o), np.minimum(theta_i, theta_o)
    return level + slope * np.maximum(0, np.cos(phi)) * np.sin(steep) * np.tan(flat)


class Study:
    """The measurement, and a body of any phase function under a smooth face."""

    def __init__(self):
        sample = jaxink.load_sample(SAMPLES / "ptfe_nist_germer_n1.35.toml")
        file = measured("ptfe_nist_germer", "brdf_regular.csv")
        self.data = jaxink.fit(file, sample, jaxink.FitOptions(profile="none")).data
        used = self.data.used
        self.bsdf = self.data.bsdf_per_sr[used]
        self.sigma = np.asarray(noise_of(self.data, sample.noise).sigma_per_sr, float)
        columns = [column[used] for column in self.data.directions]
        self.incidence_deg = columns[0]
        self.angles = tuple(np.deg2rad(c) for c in columns[:3])
        self.directions = Directions.from_degrees(*columns[:3], columns[4])

    def predicted(self, unknowns):
        """BRDF for ln of phase function and lack of albedo, index, and variance of the relief's slopes."""
        ln_values, (lack, index, variance) = unknowns[:N_VALUES], unknowns[N_VALUES:]
        layer = ScatteringLayer(index, OPAQUE_OPTICAL_THICKNESS, 1 - jnp.exp(lack), phase_of(ln_values))
        smooth = diffuse_bsdf(Stack((layer,), 1.0, 1.0), self.directions, CONFIG)
        return smooth * oren_nayar(variance, *self.angles)

    def fitted(self, free: np.ndarray) -> np.ndarray:
        """All unknowns after a fit of some of them."""
        start = np.array([*two_lobes(), np.log(ALBEDO_LACK), INDEX, 0.02 if free[-1] else 0.0])
        lowest = np.array([-6.0] * N_VALUES + [-16.0, 1.003, 0.0])
        highest = np.array([6.0] * N_VALUES + [-4.0, 1.5, 1.0])

        @jax.jit
        def whitened(some):
            unknowns = jnp.asarray(start).at[np.flatnonzero(free)].set(some)
            return (self.predicted(unknowns) - self.bsdf) / self.sigma

        slopes = jax.jit(jax.jacfwd(whitened))
        found = least_squares(
            lambda x: np.asarray(whitened(x)),
            start[free],
            lambda x: np.asarray(slopes(x)),
            bounds=(lowest[free], highest[free]),
            x_scale="jac",
        )
        start[free] = found.x
        return start


def main() -> None:
    """Fit each, keep the figures, and write the page anew."""
    with computing():
        study = Study()
        pairs = {s.scan.theta_i_deg: s.relative for s in symmetry_repeatability(study.data)}
        angles = np.unique(study.incidence_deg)
        number = np.arange(N_VALUES + 3)
        body, relief = (number == N_VALUES) | (number == N_VALUES + 1), number == N_VALUES + 2
        # Values count over their mean: one of them is held.
        shape = (number < N_VALUES) & (number != N_VALUES // 2)
        cases = {
            "two lobes, held": body,
            "a phase function of any shape": body | shape,
            "of any shape, and an uneven surface": body | shape | relief,
        }
        rows = []
        for name, free in cases.items():
            found = study.fitted(free)
            predicted = np.asarray(study.predicted(found))
            ratio = predicted / study.bsdf - 1
            by_incidence = [[float(a), rms(ratio[study.incidence_deg == a])] for a in angles]
            rows.append(
                {
                    "model": name,
                    "parameters": int(free.sum()),
                    "chi_square": float(np.sum(((predicted - study.bsdf) / study.sigma) ** 2)),
                    "by_incidence": [[a, value, pairs[a]] for a, value in by_incidence],
                    "phase_value": np.asarray(phase_of(found[:N_VALUES]).values)[::-1].tolist(),
                    "index": float(found[-2]),
                    "relief_variance": float(found[-1]),
                }
            )
            print(rows[-1], flush=True)
    PHASE_STUDY.write_text(json.dumps({"angle_deg": ANGLES_DEG.tolist(), "rows": rows}, indent=1) + "\n")
    write()


if __name__ == "__main__":
    main()

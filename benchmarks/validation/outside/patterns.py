"""Changes of a simulated measurement that no effect of the catalogue describes."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import jaxink
from benchmarks.simulated_data import data_file, declared_text
from jaxink.model.forward import ForwardModel
from jaxink.numerics.precision import computing

DESIGN = "plain_hg"
INK = {"ink.scattering_per_mm": 95.0, "ink.absorption_per_mm": 1.1, "ink.asymmetry_parameter": 0.6}
# The same ink where its scattering and absorption are others.
NEIGHBOUR = INK | {"ink.scattering_per_mm": 50.0, "ink.absorption_per_mm": 12.0}


@dataclass(frozen=True)
class Design:
    """Directions of a simulated measurement, the declared sample, and the model at the true values."""

    data: jaxink.GonioData
    sample: jaxink.Sample

    def model(self, values=INK, d_theta_i=0.0, d_signed=0.0) -> np.ndarray:
        """BSDF; all directions may be turned in the plane of incidence, in degrees."""
        theta_i, _, _, wavelength, is_transmission = self.data.directions
        signed = self.signed + d_signed
        turned = np.where(signed < 0, 0.0, 180.0)
        columns = np.abs(theta_i + d_theta_i), np.minimum(np.abs(signed), 89.5), turned
        # An incidence beyond the normal comes from the other half-plane.
        phi = np.where(theta_i + d_theta_i < 0, 180.0 - columns[2], columns[2])
        with computing():
            model = ForwardModel(self.sample, columns[0], columns[1], phi, wavelength, is_transmission)
            parameters = self.sample.parameters.items()
            start = {n: p.value for n, p in parameters if p.tie is None}
            return np.asarray(model.bsdf(start | values))

    @property
    def signed(self) -> np.ndarray:
        """Angle of view in degrees, negative in the source's half-plane."""
        return np.where(np.abs(self.data.phi_deg) < 90, -self.data.theta_o_deg, self.data.theta_o_deg)


def design(every: int = 1) -> Design:
    """The directions, or one of so many, and the sample file of a simulated measurement; not its values."""
    data = jaxink.read(data_file(DESIGN))
    data = jaxink.GonioData(*(column[::every] for column in data.directions), data.bsdf_per_sr[::every])
    return Design(data, jaxink.parse_sample(declared_text(DESIGN)))


def _radians(at: Design) -> tuple[np.ndarray, np.ndarray]:
    return np.deg2rad(at.data.theta_i_deg), np.deg2rad(at.data.theta_o_deg)


def _vignetting(at: Design, clean: np.ndarray) -> np.ndarray:
    """The detector sees less of the lit area towards grazing view."""
    return -clean * np.sin(_radians(at)[1]) ** 6


def _ghost(at: Design, clean: np.ndarray) -> np.ndarray:
    """A reflex inside the instrument reaches the detector at one angle, in reflection."""
    lobe = np.exp(-0.5 * ((at.signed + 35.0) / 3.0) ** 2)
    return np.where(at.data.is_transmission, 0.0, lobe * np.median(clean))


def _leak(at: Design, clean: np.ndarray) -> np.ndarray:
    """A filter lets a neighbouring wavelength pass, at which the ink is another."""
    return at.model(NEIGHBOUR) - clean


def _curved(at: Design, clean: np.ndarray) -> np.ndarray:
    """The sample is curved: parts of the lit area are tilted by up to 6 degrees."""
    tilts = [-6.0, -3.0, 3.0, 6.0]
    # In transmission a tilt turns the label of the direction of view the other way.
    turn = np.where(at.data.is_transmission, 1.0, -1.0)
    seen = [np.where(at.data.theta_i_deg + t > 0, at.model(INK, t, turn * t), clean) for t in tilts]
    return np.mean(seen, axis=0) - clean


def _scratches(at: Design, clean: np.ndarray) -> np.ndarray:
    """Grooves across the plane of incidence fan the specular light out in it."""
    width = 12.0 * np.cos(_radians(at)[0])
    fan = np.exp(-np.abs(at.signed - at.data.theta_i_deg) / width)
    return np.where(at.data.is_transmission, 0.0, fan * np.median(clean))


def _speckle(at: Design, clean: np.ndarray) -> np.ndarray:
    """Speckle of a coherent source: relative deviations that are correlated over about 5 degrees."""
    rng, pattern = np.random.default_rng(77), np.zeros_like(clean)
    for scan in np.unique(at.data.scan_index):
        here = at.data.scan_index == scan
        distance = (at.signed[here][:, None] - at.signed[here]) / 5.0
        pattern[here] = rng.multivariate_normal(np.zeros(here.sum()), np.exp(-0.5 * distance**2))
    return clean * pattern


def _polarised(at: Design, clean: np.ndarray) -> np.ndarray:
    """Source and detector are partly polarised, and the sample keeps some polarisation."""
    theta_i, theta_o = _radians(at)
    return clean * (np.sin(theta_i) * np.sin(theta_o)) ** 2 * np.sign(at.signed)


def _overfilled(at: Design, clean: np.ndarray) -> np.ndarray:
    """The beam is wider than the sample at oblique incidence."""
    return -clean * (1 / np.cos(_radians(at)[0]) - 1)


def _encoder(at: Design, _: np.ndarray) -> np.ndarray:
    """An eccentric encoder: the angle of view is wrong by a sine of the angle."""
    slope = (at.model(INK, 0.0, 0.5) - at.model(INK, 0.0, -0.5)) / 1.0
    return slope * np.sin(np.deg2rad(6 * at.signed))


def _shadow(at: Design, clean: np.ndarray) -> np.ndarray:
    """The arm of the detector covers part of the beam near the source."""
    near = np.exp(-0.5 * ((at.signed + at.data.theta_i_deg) / 8.0) ** 2)
    return np.where(at.data.is_transmission, 0.0, -clean * near)


def _cycle(_: Design, clean: np.ndarray) -> np.ndarray:
    """The lamp follows the air conditioning, with three cycles over the measurement."""
    return clean * np.sin(6 * np.pi * np.arange(clean.size) / clean.size)


def _reference(at: Design, clean: np.ndarray) -> np.ndarray:
    """The reference tile was not Lambertian: its calibration depends on the angle of view."""
    return clean * (np.cos(2 * _radians(at)[1]) + np.cos(4 * _radians(at)[1]))


PATTERNS: dict[str, Callable[[Design, np.ndarray], np.ndarray]] = {
    "vignetting": _vignetting,
    "ghost_reflex": _ghost,
    "wavelength_leak": _leak,
    "curved_sample": _curved,
    "scratches": _scratches,
    "speckle": _speckle,
    "partial_polarisation": _polarised,
    "overfilled_sample": _overfilled,
    "eccentric_encoder": _encoder,
    "arm_shadow": _shadow,
    "lamp_cycle": _cycle,
    "reference_tile": _reference,
}
# Root mean square of the change in standard deviations of the noise.
STRENGTHS = {"weak": 1.0, "strong": 5.0}


def simulated(name: str, strength: str, every: int = 1) -> tuple[jaxink.GonioData, jaxink.Sample, float]:
    """A simulated measurement with a pattern, the declared sample, and the largest relative change."""
    at = design(every)
    clean, noise = at.model(), at.sample.noise
    sigma = np.hypot(noise.relative * clean, noise.floor_per_sr)
    change = PATTERNS[name](at, clean)
    change *= STRENGTHS[strength] / np.sqrt(np.mean((change / sigma) ** 2))
    rng = np.random.default_rng(2026 + 100 * list(PATTERNS).index(name) + len(strength))
    factor = noise.scan_relative * rng.standard_normal(at.data.scan_index.max() + 1)[at.data.scan_index]
    exact = clean + change
    sigma = np.hypot(noise.relative * exact, noise.floor_per_sr)
    values = exact * (1 + factor) + sigma * rng.standard_normal(exact.size)
    kept = values > 0
    columns = [column[kept] for column in at.data.directions]
    data = jaxink.GonioData(*columns, values[kept], sigma[kept])
    return data, at.sample, float(np.max(np.abs(change / clean)))

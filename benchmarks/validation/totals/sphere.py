"""Readings of an integrating sphere, and what they say of a slab."""

from copy import copy
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

import jaxink
from benchmarks.validation.totals.layers import ink, rows_of, sizes_for_power
from jaxink.solver.lateral import LateralField

SPHERE = "sphere_totals_iad"
LOSSLESS = np.zeros(2)
# Which keys a stated reflectance has in the header.
REFLECTANCES = {"standard": ("r_standard",), "wall": ("R_wall", "T_wall")}
START, SMALLEST, LARGEST = np.array([0.0, 0.01]), np.array([-5.0, 0.0]), np.array([5.0, 10.0])


@dataclass(frozen=True)
class Slab:
    """One sample between two slides at one wavelength, its readings and its geometry."""

    name: str
    wavelength_nm: float
    readings: np.ndarray
    index: float
    slide_index: float
    asymmetry: float
    header: dict

    def length(self, name: str) -> float:
        """A length of the file's header in mm, or one of its reflectances."""
        return float(self.header[name])

    @property
    def thickness_mm(self) -> float:
        """Of the sample without slides."""
        return self.length("sample_thickness_mm")

    @property
    def radii_mm(self) -> tuple[float, float]:
        """Of the beam, and of the smaller sample port of both spheres."""
        ports = (self.length(f"{sphere}_sample_port_mm") for sphere in "RT")
        return self.length("beam_diameter_mm") / 2, min(ports) / 2

    def stack(self, x, lateral: LateralField | None = None) -> jaxink.Stack:
        """The slab for ln of the reduced scattering and the absorption; nothing absorbs in the slides."""
        slide = jaxink.ClearLayer(self.slide_index, 0.0)
        middle = ink(self.index, jnp.exp(x[0]), x[1], self.asymmetry, self.thickness_mm)
        return jaxink.Stack((slide, middle, slide), 1.0, 1.0, lateral=lateral)


def slabs(name: str, wavelengths_nm: tuple[float, ...], asymmetry: float | None) -> list[Slab]:
    """Rows of one sample; without an asymmetry parameter the file's own indices and g are taken."""
    header = next(row for row in rows_of(SPHERE, "header_parameters.csv") if row["sample"] == name)
    values = {
        (float(row["wavelength_nm"]), row["unit"]): float(row["value"])
        for row in rows_of(SPHERE, "totals.csv")
        if row["sample"] == name
    }
    found = []
    for wavelength in wavelengths_nm:
        index, slide = (
            values.get((wavelength, f"file_{key}"), float(header[own]))
            for key, own in (("n_sample", "n_sample"), ("n_slide", "n_slides"))
        )
        g = values[wavelength, "file_g"] if asymmetry is None else asymmetry
        readings = np.array([values[wavelength, f"sphere_M_{side}"] for side in "RT"])
        found.append(Slab(name, wavelength, readings, index, slide, g, header))
    return found


class Sphere:
    """What a sphere reads instead of R and T, and the slab that it reads them of."""

    def __init__(self, slab: Slab):
        self.slab = slab
        self.config = sizes_for_power(slab.stack(np.array([2.0, 0.0])))
        # Light from the wall of the sphere comes from everywhere: it takes the mean over the half space.
        nodes, weights = np.polynomial.legendre.leggauss(12)
        cosine, self.weight = (nodes + 1) / 2, (nodes + 1) / 2 * weights
        sines = np.append(0.0, np.sqrt(1 - cosine**2))
        self.powers = jax.jit(lambda x: jaxink.hemispherical_power(slab.stack(x), sines, self.config))

    def totals(self, x) -> tuple[np.ndarray, float]:
        """R and T of the beam, and R of diffuse light."""
        reflected, transmitted = (np.asarray(power) for power in self.powers(jnp.asarray(x)))
        return np.array([reflected[0], transmitted[0]]), float(self.weight @ reflected[1:])

    def gain(self, sphere: str, at_sample_port: float, swapped: bool = False) -> float:
        """Rise of the light in a sphere by its wall and by what covers the sample port, without a baffle."""
        get = self.slab.length
        diameter = get(f"{sphere}_sphere_d_mm")
        third = "entrance" if sphere == "R" else "exit"
        sample, open_port, detector = (
            (1 - np.sqrt(1 - (get(f"{sphere}_{port}_port_mm") / diameter) ** 2)) / 2
            for port in ("sample", third, "detector")
        )
        wall = get(f"{sphere}_wall") * (1 - sample - open_port - detector)
        return 1 / (1 - wall - (open_port if swapped else sample) * at_sample_port)

    def readings(self, x, lost=LOSSLESS) -> np.ndarray:
        """M_R and M_T, with a share of R and of T that does not come into the sphere."""
        totals, diffuse = self.totals(x)
        standard = self.slab.length("r_standard")
        gains = [
            self.gain("R", diffuse) / self.gain("R", standard),
            self.gain("T", diffuse) / self.gain("T", standard, swapped=True),
        ]
        return totals * (1 - lost) * gains

    def invert(self, lost=LOSSLESS) -> tuple[np.ndarray, float]:
        """Parameters that meet both readings, and the largest misfit that is left."""
        found = least_squares(
            lambda x: self.readings(x, lost) / self.slab.readings - 1,
            START,
            bounds=(SMALLEST, LARGEST),
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
        )
        return found.x, float(np.max(np.abs(found.fun)))

    def with_reflectance(self, name: str, change: float) -> "Sphere":
        """The same slab and ports, one of the stated reflectances changed."""
        header = self.slab.header
        changed = {key: float(header[key]) + change for key in REFLECTANCES[name]}
        other = copy(self)
        other.slab = replace(self.slab, header={**header, **changed})
        return other

    def jacobian(self, x, lost) -> np.ndarray:
        """Of the readings by ln of the reduced scattering, ln of the absorption and the share of the loss."""
        step = 1e-4
        columns = [
            (self.readings(x + move, LOSSLESS) - self.readings(x - move, LOSSLESS)) / (2 * step)
            for move in step * np.diag([1.0, x[1]])
        ]
        return np.stack([*columns, -lost * self.readings(x)], axis=1)

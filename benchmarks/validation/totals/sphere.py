"""Readings of an integrating sphere: what they say of a slab, and the light that misses the port."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

import jaxink
from benchmarks.montecarlo.photons import simulate
from benchmarks.montecarlo.sample import HenyeyGreenstein as DrawnHenyeyGreenstein
from benchmarks.montecarlo.sample import Layer, Sample
from benchmarks.validation.totals.layers import ink, rows_of, sizes_for_power, stack_of
from jaxink.solver.lateral import LateralField

SPHERE = "sphere_totals_iad"
# Light that misses the sample port is followed with this many photons, twice each time.
N_PHOTONS, LOSS_ROUNDS = 30_000, 2
# How much thinner an ink is that has no room to walk in.
SQUEEZED = 1e3
LOSSLESS = np.zeros(2)
LOSSES = NO_LOSS, IN_SLIDES, IN_ALL = "no loss", "in the slides", "in slides and ink"
# Error of a reflectance that the header states, to see what it does, and which keys it has there.
REFLECTANCE_ERROR = 0.01
REFLECTANCES = {"standard": ("r_standard",), "wall": ("R_wall", "T_wall")}
# As the diagnosis has it: no more points than parameters.
NOT_TESTABLE = "not_testable"
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
        found = stack_of([slide, middle, slide], [self.slide_index, self.index, self.slide_index])
        return replace(found, lateral=lateral)


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


def lost_in_slides(sphere: Sphere) -> Callable:
    """Shares of R and T beside the port by the library, which lets light walk in clear layers only."""
    slab = sphere.slab
    nodes, weights = np.polynomial.legendre.leggauss(24)
    cosine, weight = (nodes + 1) / 2, np.pi * (nodes + 1) / 2 * weights
    theta = np.tile(np.rad2deg(np.arccos(cosine)), 2)
    is_transmission = np.repeat([False, True], cosine.size)
    directions = jaxink.Directions.from_degrees(
        np.zeros(theta.size), theta, np.full(theta.size, 180.0), is_transmission
    )
    slide = slab.length("slide_thickness_mm")
    field = LateralField(*slab.radii_mm, [slide, 0.0, slide])

    @jax.jit
    def lost(x):
        whole, seen = (
            jaxink.diffuse_bsdf(slab.stack(x, lateral), directions, sphere.config)
            for lateral in (None, field)
        )
        return jnp.sum((whole - seen).reshape(2, -1) * weight, axis=1)

    return lambda x: (np.asarray(lost(jnp.asarray(x))) / sphere.totals(x)[0], LOSSLESS)


def lost_by_photons(slab: Slab, x, squeezed: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Shares of R and T beside the port by Monte Carlo, in slides and ink, and their standard errors.

    The same photons are counted twice, with the port and without, so that only those beside it make noise.
    An ink squeezed by a large factor has the same optical thickness and no room to walk in.
    """
    slide = Layer(slab.slide_index, slab.length("slide_thickness_mm"))
    scattering, absorption = squeezed * np.array([np.exp(x[0]) / (1 - slab.asymmetry), x[1]])
    phase = DrawnHenyeyGreenstein(slab.asymmetry)
    middle = Layer(slab.index, slab.thickness_mm / squeezed, scattering, absorption, phase)
    beam, port = slab.radii_mm
    counts = [
        simulate(Sample((slide, middle, slide), beam_radius_mm=beam, seen_radius_mm=radius), 0.0, N_PHOTONS)
        for radius in (None, port)
    ]
    whole, seen = (
        np.stack([c.powers[f"{side}_regular"] + c.powers[f"{side}_diffuse"] for side in "RT"]) for c in counts
    )
    share = (whole - seen) / whole.mean(axis=1, keepdims=True)
    return share.mean(axis=1), share.std(axis=1, ddof=1) / np.sqrt(share.shape[1])


@dataclass(frozen=True)
class Inferred:
    """One slab without loss, with that in the slides and with that in slides and ink, by these names.

    ``lost_squeezed``: by photons with a squeezed ink, and its standard error. ``by_reflectance``: absorption
    without loss if one of the stated reflectances is higher by `REFLECTANCE_ERROR`.
    """

    slab: Slab
    totals: np.ndarray
    lost: dict[str, np.ndarray]
    lost_error: np.ndarray
    lost_squeezed: tuple[np.ndarray, np.ndarray]
    parameters: dict[str, np.ndarray]
    misfits: dict[str, float]
    by_reflectance: dict[str, float]
    jacobian: np.ndarray

    def change(self, loss: str) -> float:
        """Of the absorption by a loss, in percent."""
        return self.changed_to(self.parameters[loss][1])

    def changed_to(self, absorption_per_mm: float) -> float:
        """Change of the absorption from that without loss, in percent."""
        return 100 * (absorption_per_mm / self.parameters[NO_LOSS][1] - 1)

    @property
    def rank(self) -> int:
        """Of the derivatives of both readings."""
        return int(np.linalg.matrix_rank(self.jacobian))

    @property
    def outside(self) -> float:
        """Share of the loss's derivative that scattering and absorption cannot imitate."""
        known, loss = self.jacobian[:, :2], self.jacobian[:, 2]
        left = loss - known @ np.linalg.lstsq(known, loss, rcond=None)[0]
        return float(np.linalg.norm(left) / np.linalg.norm(loss))

    @property
    def condition(self) -> float:
        """Of scattering and absorption, their columns scaled to unit length."""
        known = self.jacobian[:, :2]
        return float(np.linalg.cond(known / np.linalg.norm(known, axis=0)))

    @property
    def verdict(self) -> str:
        """Code and reason."""
        points, parameters = self.slab.readings.size, self.parameters[NO_LOSS].size
        if points > parameters:
            raise SystemExit("there are more readings than parameters: the loss has to be tested.")
        return (
            f"`{NOT_TESTABLE}`: {points} readings, {parameters} parameters without the loss, "
            f"{points - parameters} degrees of freedom"
        )


def losses_in_slides(slab: Slab, x) -> list[tuple[str, np.ndarray, tuple[np.ndarray, np.ndarray]]]:
    """The loss in the slides by the library and by photons in a squeezed ink, as the slab is made simpler."""
    isotropic = replace(slab, asymmetry=0.0)
    cases = {
        "as it is": slab,
        "g = 0": isotropic,
        "g = 0, slides of the index of the ink": replace(isotropic, slide_index=slab.index),
    }
    return [
        (name, lost_in_slides(Sphere(case))(x)[0], lost_by_photons(case, x, SQUEEZED))
        for name, case in cases.items()
    ]


def inferred(slab: Slab) -> Inferred:
    """Invert the readings of one slab; a loss depends on the solution, so both are found in rounds."""
    sphere = Sphere(slab)
    start, misfit = sphere.invert()
    parameters, misfits, lost = {NO_LOSS: start}, {NO_LOSS: misfit}, {NO_LOSS: LOSSLESS}
    in_slides = lost_in_slides(sphere)
    for name, loss in ((IN_SLIDES, in_slides), (IN_ALL, lambda x: lost_by_photons(slab, x))):
        found, error = start, None
        for _ in range(LOSS_ROUNDS):
            lost[name], error = loss(found)
            found, misfits[name] = sphere.invert(lost[name])
        parameters[name] = found
    squeezed = lost_by_photons(slab, parameters[IN_SLIDES], SQUEEZED)
    by_reflectance = {
        name: float(sphere.with_reflectance(name, REFLECTANCE_ERROR).invert()[0][1]) for name in REFLECTANCES
    }
    return Inferred(
        slab,
        sphere.totals(start)[0],
        lost,
        error,
        squeezed,
        parameters,
        misfits,
        by_reflectance,
        sphere.jacobian(start, lost[IN_ALL]),
    )

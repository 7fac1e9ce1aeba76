"""What the "scattering" column of a published table of inks can mean; writes published-tables.md.

Each of three inks is printed twice, as a Henyey-Greenstein row and as a Mie row (inks_2021.csv). A
coefficient per mm follows from the former only with a reading of its columns. Each reading is put through the
forward model, and the BSDF compared with that of the ink's Mie row.

python -m benchmarks.validation.published_tables
"""

import csv
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

import jaxink
from benchmarks.pages import filled, machine, rms, table, write_page
from jaxink.model.forward import ForwardModel
from jaxink.numerics.precision import computing
from jaxink.particles.mie import mie_coefficients

PRINTED = Path(__file__).with_name("inks_2021.csv")
BINDER_INDEX, PLATE_INDEX, PLATE_MM = 1.5, 1.5, 1.0
INCIDENCES_DEG = (0.0, 15.0, 30.0, 45.0, 60.0)
# To 75 degrees, and not where the regular peaks or the source are.
SIGNED_DEG = np.arange(-72.5, 75.1, 5.0)
# A rough face throws light that the ink has not scattered around the undeviated beam, to this distance.
BESIDE_THE_BEAM_DEG = 15.0


class Ink(NamedTuple):
    """What is printed of one ink, and under which circumstances its rows are compared."""

    name: str
    lobe: dict[str, str]
    spheres: dict[str, str]
    thickness_um: float
    wavelength_nm: float
    sides: str


# Thickness, wavelength, and what was measured. Printed: 63 and 100 um, and 570 to 630 nm, of which the middle
# is taken. Not printed and assumed: 63 um of sample 2, and 550 nm.
CIRCUMSTANCES = {"1": (63.0, 550.0, "RT"), "2": (63.0, 550.0, "RT"), "3": (100.0, 600.0, "R")}

# Coefficient per mm from the printed value and the printed concentration in percent.
READINGS: dict[str, Callable[[float, float], float | None]] = {
    "coefficient per mm": lambda value, _: value,
    "coefficient per mm and per cent of concentration": lambda value, percent: value * percent,
    "coefficient per mm of undiluted particles": lambda value, percent: value * percent / 100,
    "coefficient per mm, to be divided by the concentration in per cent": lambda value, percent: (
        value / percent
    ),
    "coefficient per mm, to be divided by the volume fraction": lambda value, percent: 100 * value / percent,
    "fraction of a beam scattered in 1 mm": lambda value, _: _of_fraction(value),
    "per cent of a beam scattered in 1 mm": lambda value, _: _of_fraction(value / 100),
    "per cent of a beam scattered in 1 mm at a concentration of 1 %": lambda value, percent: _times(
        _of_fraction(value / 100), percent
    ),
}


# Those in which the coefficient is proportional to the printed value.
LINEAR = tuple(READINGS)[:5]


def _of_fraction(fraction: float) -> float | None:
    """Coefficient that scatters this fraction in 1 mm; none does if it is 1 or more."""
    return -math.log(1 - fraction) if fraction < 1 else None


def _times(coefficient: float | None, factor: float) -> float | None:
    return None if coefficient is None else coefficient * factor


def inks() -> list[Ink]:
    """All inks of the publication."""
    with PRINTED.open(newline="", encoding="utf-8") as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    by_model = {(row["sample"], row["model"]): row for row in rows}
    return [
        Ink(name, by_model[name, "henyey_greenstein"], by_model[name, "mie"], *circumstances)
        for name, circumstances in CIRCUMSTANCES.items()
    ]


def _sample_text(ink: Ink, layer: str, row: dict[str, str]) -> str:
    """Sample file of one row of an ink: the plate, then the ink, lit through the plate."""
    sigma = row["cauchy_sigma_deg"]
    rough = f'back_roughness = {{ density = "cauchy", sigma_deg = {sigma} }}' if sigma else ""
    return f"""schema_version = 1
wavelength_nm = {ink.wavelength_nm}
[[layers]]
name = "plate"
kind = "clear"
refractive_index = {PLATE_INDEX}
thickness_mm = {PLATE_MM}
[[layers]]
name = "ink"
kind = "scattering"
refractive_index = {BINDER_INDEX}
thickness_um = {ink.thickness_um}
{layer}
{rough}
"""


def spheres_text(ink: Ink) -> str:
    """Sample file of the Mie row."""
    row = ink.spheres
    layer = f"""phase_function = "mie"
radius_nm = {row["radius_nm"]}
volume_fraction = {float(row["pvc_percent"]) / 100}
particle_index = {row["particle_index"]}
particle_absorption_index = {row["particle_absorption_index"]}"""
    return _sample_text(ink, layer, row)


def lobe_text(ink: Ink) -> str:
    """Sample file of the Henyey-Greenstein row, its coefficients to be given."""
    layer = f"""phase_function = "henyey_greenstein"
asymmetry_parameter = {ink.lobe["anisotropy_g"]}
scattering_per_mm = {{ free = true, value = 50, min = 0, max = 1e6 }}
absorption_per_mm = {{ free = true, value = 0, min = 0, max = 1e6 }}"""
    return _sample_text(ink, layer, ink.lobe)


class Compared:
    """Both rows of one ink through the forward model at the directions measured."""

    def __init__(self, ink: Ink):
        sides = [side == "T" for side in ink.sides]
        far, theta_i, signed = (
            a.ravel() for a in np.meshgrid(sides, INCIDENCES_DEG, SIGNED_DEG, indexing="ij")
        )
        phi, wavelength = np.where(signed < 0, 0.0, 180.0), np.full(signed.size, ink.wavelength_nm)
        columns = theta_i, np.abs(signed), phi, wavelength, far
        self.ink = ink
        model = ForwardModel(jaxink.parse_sample(lobe_text(ink)), *columns)
        self._lobe = jax.jit(model.bsdf)
        self._spheres = np.asarray(ForwardModel(jaxink.parse_sample(spheres_text(ink)), *columns).bsdf())
        # What is averaged over, by its name.
        self._parts = {side: far == (side == "T") for side in ink.sides}
        if ink.lobe["cauchy_sigma_deg"]:
            self._parts["T off the beam"] = far & (np.abs(signed - theta_i) > BESIDE_THE_BEAM_DEG)
        self._fitted = far & (theta_i == 0) if "T" in ink.sides else ~far
        self._cosine = np.cos(np.deg2rad(signed))
        self._theta_i_deg = theta_i

    def _both(self, scattering_per_mm: float, absorption_per_mm: float) -> tuple[np.ndarray, np.ndarray]:
        values = {"ink.scattering_per_mm": scattering_per_mm, "ink.absorption_per_mm": absorption_per_mm}
        return np.asarray(self._lobe(values)), self._spheres

    def rms_by_part(self, scattering_per_mm: float, absorption_per_mm: float) -> dict[str, float]:
        """Root mean square of pi times the difference of the BSDFs, in each part, and of all."""
        lobe, spheres = self._both(scattering_per_mm, absorption_per_mm)
        difference = np.pi * (lobe - spheres)
        return {name: rms(difference[part]) for name, part in self._parts.items()} | {"all": rms(difference)}

    def best_linear(self, part: str) -> list[tuple[float, str]]:
        """Least rms in a part by a linear reading, and its name: all incidences, 0 and 60 degrees."""
        pairs = {name: self._both(*coefficients_of(self.ink, READINGS[name])) for name in LINEAR}
        found = []
        for incidences in (INCIDENCES_DEG, (0.0,), (60.0,)):
            here = self._parts[part] & np.isin(self._theta_i_deg, incidences)
            each = ((rms(np.pi * (lobe - spheres)[here]), name) for name, (lobe, spheres) in pairs.items())
            found.append(min(each))
        return found

    def published_rmsd(self, scattering_per_mm: float, absorption_per_mm: float) -> float:
        """RMSD of the two rows by the publication's objective of this ink, over what it was fitted to."""
        lobe, spheres = self._both(scattering_per_mm, absorption_per_mm)
        fitted = self._fitted
        if self.ink.lobe["rmsd_kind"] == "absolute":
            return rms((self._cosine * (lobe - spheres))[fitted])
        a, b = np.log(lobe[fitted]), np.log(spheres[fitted])
        return rms((a - b) / (0.5 * (a + b)))

    @property
    def allowed_rmsd(self) -> float:
        """Sum of the printed RMSDs of both rows from one measurement: theirs from each other is no larger."""
        return sum(float(row["rmsd_percent"]) for row in (self.ink.lobe, self.ink.spheres)) / 100

    def best_scattering(self) -> tuple[float, dict[str, float]]:
        """The coefficient with which the printed g and ratio of coefficients come closest, whatever it is."""
        from scipy.optimize import minimize_scalar

        ratio = float(self.ink.lobe["absorption"]) / float(self.ink.lobe["scattering"])

        def by_logarithm(x):
            return self.rms_by_part(np.exp(x), ratio * np.exp(x))

        grid = np.linspace(np.log(0.1), np.log(5000), 30)
        near = grid[np.argmin([by_logarithm(x)["all"] for x in grid])]
        step = grid[1] - grid[0]
        found = minimize_scalar(lambda x: by_logarithm(x)["all"], (near - step, near, near + step), tol=1e-4)
        return float(np.exp(found.x)), by_logarithm(found.x)


def reduced_scattering_per_mm(ink: Ink) -> float:
    """Scattering coefficient times 1 - g of the ink's spheres."""
    row = ink.spheres
    index = complex(float(row["particle_index"]), float(row["particle_absorption_index"]))
    concentration = float(row["pvc_percent"]) / 100
    found = mie_coefficients(float(row["radius_nm"]), index, concentration, BINDER_INDEX, ink.wavelength_nm)
    return float(found.scattering_coefficient_per_mm * (1 - found.phase_function.asymmetry_parameter))


def inks_table(printed: list[Ink]) -> str:
    """Both rows of each ink as printed, and the reduced scattering of its spheres."""
    header = ["ink", "scattering", "concentration, %", "g", "radius, nm", "index"]
    header += ["concentration of spheres, %", "absorption", "mu_s (1 - g) of the spheres, 1/mm"]
    rows = []
    for ink in printed:
        lobe, spheres = ink.lobe, ink.spheres
        index = f"{float(spheres['particle_index']):g} + {float(spheres['particle_absorption_index']):g}i"
        cells = [ink.name, lobe["scattering"], lobe["pvc_percent"], lobe["anisotropy_g"]]
        cells += [spheres["radius_nm"], index, spheres["pvc_percent"], lobe["absorption"]]
        rows.append([*cells, f"{reduced_scattering_per_mm(ink):.4g}"])
    return table(header, rows)


def coefficients_of(ink: Ink, reading: Callable[[float, float], float | None]) -> list[float] | None:
    """Scattering and absorption per mm by one reading; None if it excludes the printed values."""
    percent = float(ink.lobe["pvc_percent"])
    scattering, absorption = (reading(float(ink.lobe[key]), percent) for key in ("scattering", "absorption"))
    return None if scattering is None or absorption is None else [scattering, absorption]


def _cell(scattering_per_mm: float, of_parts: dict[str, float]) -> str:
    parts = ", ".join(f"{name} {100 * value:.1f}" for name, value in of_parts.items() if name != "all")
    return f"{scattering_per_mm:.4g}: {parts}"


def readings_tables(compared: list[Compared]) -> tuple[str, str, list[str], list[tuple[float, dict]]]:
    """Both tables, the readings that all inks allow, and the free coefficient of each ink."""
    rows, published, allowed = [], [], []
    for name, reading in READINGS.items():
        tried = [coefficients_of(one.ink, reading) for one in compared]
        if None in tried:
            rows.append([name, *(["impossible"] * len(compared))])
            continue
        pairs = list(zip(compared, tried, strict=True))
        rows.append([name, *(_cell(c[0], one.rms_by_part(*c)) for one, c in pairs)])
        rmsd = [one.published_rmsd(*c) for one, c in pairs]
        published.append([name, *(f"{100 * value:.2f}" for value in rmsd)])
        if all(value <= one.allowed_rmsd for value, one in zip(rmsd, compared, strict=True)):
            allowed.append(name)
    free = [one.best_scattering() for one in compared]
    rows.append(["none: the coefficient that comes closest", *(_cell(*each) for each in free)])
    published.append(["sum of the printed RMSDs", *(f"{100 * one.allowed_rmsd:.2f}" for one in compared)])
    heads = ["reading of the value", *(f"ink {one.ink.name}" for one in compared)]
    return table(heads, rows), table(heads, published), allowed, free


def page() -> str:
    """The whole page."""
    began, printed = time.perf_counter(), inks()
    compared = [Compared(ink) for ink in printed]
    readings, published, allowed, free = readings_tables(compared)
    factors = [
        f"{coefficient / float(ink.lobe['scattering']):.3g} for ink {ink.name} (concentration "
        f"{ink.lobe['pvc_percent']} %)"
        for (coefficient, _), ink in zip(free, printed, strict=True)
    ]
    return filled(
        Path(__file__).with_suffix(".md.in"),
        binder=BINDER_INDEX,
        inks=inks_table(printed),
        readings=readings,
        published=published,
        trial=trial_table(compared),
        factors=", ".join(factors),
        verdict=_verdict(allowed),
        seconds=time.perf_counter() - began,
        machine=machine(),
    )


def trial_table(compared: list[Compared]) -> str:
    """What linear readings leave at best, by incidence, and for ink 3 with the other sign of g."""
    first, second, third = compared
    g = third.ink.lobe["anisotropy_g"].lstrip("-")
    turned = third.ink._replace(lobe={**third.ink.lobe, "anisotropy_g": g})
    cases = [("ink 1, T", first, "T"), ("ink 2, T", second, "T")]
    cases += [("ink 2, T off the beam", second, "T off the beam"), ("ink 3, R", third, "R")]
    cases += [
        (f"ink 3, R, with g = +{g}, {nm:g} nm", Compared(turned._replace(wavelength_nm=nm)), "R")
        for nm in (600.0, 550.0)
    ]
    rows = [
        [name, *(f"{100 * value:.1f} ({reading})" for value, reading in one.best_linear(part))]
        for name, one, part in cases
    ]
    return table(["", "all incidences", "0 degrees", "60 degrees"], rows)


def _verdict(allowed: list[str]) -> str:
    if allowed:
        names = "\n".join(f"* {name}" for name in allowed)
        return f"Adopted, as the two rows of all three inks may agree:\n{names}"
    return (
        "**None is adopted.** No reading brings the two rows of all three inks within the sum of the RMSDs\n"
        "with which they were fitted to one measurement."
    )


if __name__ == "__main__":
    with computing():
        write_page("published-tables.md", page())

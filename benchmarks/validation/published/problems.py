"""The seven published reconstructions on simulated stand-ins, each as a problem of least squares.

Shared by the page on the protocols and by the comparison of optimisers:

>>> one = problem("white_ink_mie-mie", "protocol")
>>> one.objective(), one.sample.parameters.free, one.kind

Inks of 2021: white_ink_mie is sample 1, white_ink_rough sample 2, coloured_ink sample 3, simulated from the
printed Mie rows by an independent program; sheet_2018 is simulated by `sheet_2018`.
"""

import dataclasses
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import jaxink
from benchmarks.simulated_data import data_file, declared_text
from benchmarks.validation.published.spectral_shape import shape_of_absorption_index, shape_of_scattering
from benchmarks.validation.simulated.fits import FREE_SIGMA
from jaxink.fitting import make_objective, prepare_data
from jaxink.fitting.fit_objective import FitObjective
from jaxink.fitting.joint_objective import JointObjective
from jaxink.measurement import GonioData, noise_of
from jaxink.projects import Measurement
from jaxink.sample import Sample, parse_sample
from jaxink.sample.turning import opposite_medium, turned_over

WHITE, ROUGH, COLOURED, SHEET = "white_ink_mie", "white_ink_rough", "coloured_ink", "sheet_2018"
# Names of the seven: the stand-in, then the model that is fitted.
NAMES = (
    *(f"{ink}-{model}" for ink in (WHITE, ROUGH, COLOURED) for model in ("mie", "hg")),
    f"{SHEET}-mie",
)
# What is fitted: the publication's own choice, and everything that was measured.
PROTOCOL, EVERYTHING = "protocol", "everything"
# Between them: the same scans by chi-square, and one scan more.
WEIGHTED, WITH_R, WITH_T_45 = "protocol-chi-square", "T-R-at-0", "T-at-0-45"

# Start and ranges as printed. Of what is not printed: binder and sheet have the same index, 1.5, the spheres
# do not absorb, and light has 550 nm. The noise is that of the simulation.
SHEET_TEXT = """schema_version = 1
title = "Simulated: the sheet of 2018, lit from the bottom"
wavelength_nm = 550
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1.0
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "mie"
refractive_index = 1.5
thickness_um = { free = true, value = 200, min = 100, max = 300 }
radius_nm = { free = true, value = 500, min = 100, max = 1000 }
volume_fraction = { free = true, value = 0.03, min = 0.02, max = 0.04 }
particle_index = { free = true, value = 1.7, min = 1.5, max = 2.0 }
particle_absorption_index = 0
[noise]
scan_relative = 0.004
[masks]
specular_half_angle_deg = 0
undeviated_half_angle_deg = 0
retro_half_angle_deg = 0
"""


@dataclasses.dataclass(frozen=True)
class Problem:
    """Measurements of one ink, what is known of it, and what is minimised.

    Parameters
    ----------
    name
        One of `NAMES`.
    scans
        What is fitted, one of `variants`.
    measurements
        Measurement, with its masks, and sample, for each face that is lit: one, or both.
    kind
        A kind of objective of jaxink.
    """

    name: str
    scans: str
    measurements: tuple[tuple[GonioData, Sample], ...]
    kind: str

    @property
    def data(self) -> GonioData:
        """The measurement lit from the first face."""
        return self.measurements[0][0]

    @property
    def sample(self) -> Sample:
        """The sample lit from the first face; its parameters are those of both."""
        return self.measurements[0][1]

    @property
    def is_of_spheres(self) -> bool:
        """Whether the ink is described by spheres, as it was simulated."""
        return self.name.endswith("-mie")

    @property
    def project(self) -> jaxink.Project:
        """The measurements with their samples, whose parameters all share."""
        faces = ("front", "back")[: len(self.measurements)]
        return jaxink.Project(
            tuple(
                Measurement(face, data, sample, {_own(name, face): name for name in self.sample.parameters})
                for face, (data, sample) in zip(faces, self.measurements, strict=True)
            )
        )

    def objective(self, resolution: Any = None) -> FitObjective:
        """What is minimised, at a resolution; None: that for the start."""
        if len(self.measurements) == 1:
            return make_objective(self.data, self.sample, self.kind, resolution)
        noises = [noise_of(data, sample.noise) for data, sample in self.measurements]
        return JointObjective.of(self.project, noises, self.kind, resolution)


def _own(name: str, face: str) -> str:
    """Name of a parameter in the sample that is lit from a face."""
    return name if face == "front" else opposite_medium(name)


def variants(name: str) -> tuple[str, ...]:
    """What can be fitted: the protocol, scans added to it, and everything."""
    ink = name.split("-")[0]
    if ink in (COLOURED, SHEET):
        return (PROTOCOL, WEIGHTED, EVERYTHING)
    return (PROTOCOL, WEIGHTED, WITH_R, WITH_T_45, EVERYTHING)


@cache
def measured(ink: str) -> tuple[GonioData, ...]:
    """All that was measured of a stand-in, for each face that is lit: first the plate or the bottom."""
    if ink == SHEET:
        folder = Path(__file__).parent / SHEET
        return tuple(jaxink.read(folder / f"{face}.csv") for face in ("bottom", "top"))
    return (jaxink.read(data_file(ink)),)


def problem(name: str, scans: str = EVERYTHING) -> Problem:
    """One of the seven, with what is fitted of it.

    Parameters
    ----------
    name
        One of `NAMES`.
    scans
        One of `variants`. `PROTOCOL` is the published one, with its objective; all others are fitted by
        chi-square, and `EVERYTHING` of the coloured ink without the published shape.
    """
    ink, model = name.split("-")
    sample = parse_sample(_text(ink, model, scans), name)
    samples = (sample, turned_over(sample)) if ink == SHEET else (sample,)
    published = {SHEET: "relative", COLOURED: "logarithmic"}.get(ink, "absolute")
    kind = published if scans == PROTOCOL else "chi_square"
    parts = tuple(
        (prepare_data(_rows(ink, scans)(data), one), one)
        for data, one in zip(measured(ink), samples, strict=True)
    )
    return Problem(name, scans, parts, kind)


def _rows(ink: str, scans: str) -> Callable[[GonioData], GonioData]:
    """Which rows of a measurement are fitted."""
    if scans == EVERYTHING:
        return lambda data: data
    if ink == SHEET:
        return lambda data: data.select(theta_i_deg=0.0)
    if ink == COLOURED:
        return lambda data: data.select(side="R")
    if scans == WITH_R:
        return lambda data: data.select(theta_i_deg=0.0)
    return lambda data: data.select(side="T", theta_i_deg=[0.0, 45.0] if scans == WITH_T_45 else 0.0)


def _text(ink: str, model: str, scans: str) -> str:
    """Sample file: what is declared, as spheres or with Henyey-Greenstein scattering."""
    if ink == SHEET:
        return SHEET_TEXT
    text = declared_text(ink, None if model == "mie" else model)
    text = re.sub(r"sigma_deg = [0-9.]+", FREE_SIGMA, text)
    if ink == COLOURED and scans != EVERYTHING:
        data = measured(ink)[0]
        if model == "mie":
            return _with_shape(text, "particle_absorption_index", shape_of_absorption_index(data))
        text = _with_shape(text, "scattering_per_mm", shape_of_scattering(data))
        # Of the absorption, one number is printed.
        return re.sub(r"(absorption_per_mm = \{.*?), per_wavelength = true", r"\1", text)
    return text


def _with_shape(text: str, key: str, shape: list[float]) -> str:
    ratios = ", ".join(f"{one:.6g}" for one in shape)
    text, n = re.subn(rf"({key} = \{{.*?), per_wavelength = true", rf"\1, shape = [{ratios}]", text)
    assert n == 1, f"{key} is not free by wavelength"
    return text

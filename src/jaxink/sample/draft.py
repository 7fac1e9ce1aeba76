"""A first sample file, written from a measurement and the little that is known of the sample."""

import dataclasses
import json
import math
from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError, require_one_of
from jaxink.measurement import MINIMUM_PAIRS, SAME, GonioData, diffuse_reflectance, estimate_noise
from jaxink.sample.measurement_schema import SCHEMA_VERSION
from jaxink.sample.schema import OPAQUE

ORDERS = ("plate,ink", "ink,plate", "ink")
DRAFTED_PHASE_FUNCTIONS = ("henyey_greenstein", "two_term_henyey_greenstein", "rayleigh", "mie")
_HAVE_ASYMMETRY = DRAFTED_PHASE_FUNCTIONS[:2]
# Whether one asymmetry serves all wavelengths, or each has its own.
ASYMMETRIES = ("one", "each")
_OF_ASYMMETRY = {"one": "One for all wavelengths", "each": "Each wavelength has its own"}
_START_ASYMMETRY = 0.6
_GUESSED_NOISE = 0.02
# Range of the optical thickness of an ink, and its largest absorption.
_OPTICAL_THICKNESS, _ABSORBED = (0.01, 300.0), 5.0


@dataclasses.dataclass(frozen=True)
class Draft:
    """What a user knows of a sample at first; the defaults are usual values.

    Parameters
    ----------
    order
        One of `ORDERS`: the layers in the order in which light meets them.
    plate_index, plate_mm
        Refractive index and thickness of the clear plate.
    ink_index
        Refractive index of the ink's binder.
    ink_um
        Thickness of the ink, or ``opaque``.
    phase_function
        One of `DRAFTED_PHASE_FUNCTIONS`.
    particle_index, radius_nm
        For ``mie``: refractive index of the particles, and a guess of their radius.
    wavelengths_nm
        Wavelengths of the measurement that are fitted; empty: all of them.
    asymmetry
        One of `ASYMMETRIES`, for a Henyey-Greenstein function at several wavelengths.
    colour_from_reflectance
        Whether the spectrum of the ink has the shape that its diffuse reflectance gives it, and only its
        mean is free: of the absorption index for ``mie``, of the scattering coefficient otherwise.
    """

    __repr__ = brief_repr

    order: str = ORDERS[0]
    plate_index: float = 1.49
    plate_mm: float = 3.0
    ink_index: float = 1.5
    ink_um: float | str = 20.0
    phase_function: str = DRAFTED_PHASE_FUNCTIONS[0]
    particle_index: float = 2.6
    radius_nm: float = 150.0
    wavelengths_nm: tuple[float, ...] = ()
    asymmetry: str = ASYMMETRIES[0]
    colour_from_reflectance: bool = False

    def __post_init__(self):
        require_one_of("order", self.order, ORDERS)
        require_one_of("phase_function", self.phase_function, DRAFTED_PHASE_FUNCTIONS)
        require_one_of("asymmetry", self.asymmetry, ASYMMETRIES)
        if self.ink_um != OPAQUE and not (
            isinstance(self.ink_um, int | float) and 0 < self.ink_um < math.inf
        ):
            raise InputRefusedError(f"ink_um is {self.ink_um!r}; it must be a thickness in um, or {OPAQUE}.")
        if self.ink_um == OPAQUE and self.layers[-1] != "ink":
            raise InputRefusedError(
                f"ink_um is {OPAQUE}, but the order is {self.order}, so no light reaches the plate; the ink "
                "must be the last layer."
            )

    @property
    def layers(self) -> list[str]:
        """Names of the layers in their order."""
        return self.order.split(",")

    @property
    def needed(self) -> tuple[str, ...]:
        """Fields that this sample depends on."""
        plate = ("plate_index", "plate_mm") if "plate" in self.layers else ()
        particles = ("particle_index", "radius_nm") if self.phase_function == "mie" else ()
        several = len(self.wavelengths_nm) > 1 and self.phase_function in _HAVE_ASYMMETRY
        asymmetry = ("asymmetry",) if several else ()
        return ("order", *plate, "ink_index", "ink_um", "phase_function", *particles, *asymmetry)


def lit_order(data: GonioData) -> str | None:
    """The order of plate and ink that a column ``lit_side`` states, if there is one."""
    sides = {str(side).strip().lower() for side in data.extra.get("lit_side", np.array([])).tolist()}
    return {"plate": ORDERS[0], "ink": ORDERS[1]}.get(sides.pop()) if len(sides) == 1 else None


def draft_text(data: GonioData, draft: Draft, assumed: Collection[str] = ()) -> str:
    """Text of a sample file with comments, which a fit can start from.

    Parameters
    ----------
    data
        The measurement.
    draft
        What is known of the sample.
    assumed
        Fields of the draft that nobody has stated; comments say so.
    """
    if draft.ink_um == OPAQUE and data.is_transmission.any():
        raise InputRefusedError(
            f"{data.source}: has rows with side T, but ink_um is {OPAQUE}; give the thickness of the ink."
        )
    wavelengths = chosen_wavelengths(data, draft.wavelengths_nm)
    shape: tuple[float, ...] = ()
    if draft.colour_from_reflectance:
        shape = _shape(data, draft, wavelengths)
    writer = _Writer(data, draft, frozenset(assumed), wavelengths, shape)
    lines = [*writer.head()]
    for layer in draft.layers:
        lines += [*(writer.plate() if layer == "plate" else writer.ink())]
    return "\n".join([*lines, *_noise(data), *_OPTIONAL]) + "\n"


def _shape(data: GonioData, draft: Draft, wavelengths: list[float]) -> tuple[float, ...]:
    """Ratios of the spectrum of the ink at the wavelengths, from its diffuse reflectance.

    Raises
    ------
    InputRefusedError
        If there is one wavelength, no reading in reflection, or the layer is opaque.
    """
    name = data.source or "the measurement"
    if len(wavelengths) < 2:
        raise InputRefusedError(
            f"{name}: has one wavelength, so its colour has no shape; leave out --colour-from-reflectance."
        )
    if draft.ink_um == OPAQUE and draft.phase_function != "mie":
        raise InputRefusedError(
            f"ink_um is {OPAQUE}, so the ink has no scattering coefficient to be given a shape; "
            "leave out --colour-from-reflectance, or give the thickness."
        )
    found = diffuse_reflectance(data.select(wavelength_nm=wavelengths))
    if len(found.wavelength_nm) < len(wavelengths):
        raise InputRefusedError(f"{name}: lacks readings in reflection at some wavelengths.")
    is_mie = draft.phase_function == "mie"
    shape = found.absorption_index_shape if is_mie else found.scattering_shape
    return tuple(shape.tolist())


def chosen_wavelengths(data: GonioData, wanted_nm: Sequence[float]) -> list[float]:
    """The wanted wavelengths as the measurement has them, in ascending order; all if none is named.

    Raises
    ------
    InputRefusedError
        If the measurement lacks one of them.
    """
    held = np.unique(data.wavelength_nm)
    if not wanted_nm:
        return held.tolist()
    found = set[float]()
    for nm in wanted_nm:
        near = held[np.abs(held - nm) < SAME]
        if not near.size:
            text = f"wavelengths has {nm:g}, but the measurement has {_listed(held)} nm"
            raise InputRefusedError(f"{data.source or 'GonioData'}: {text}.")
        found.add(float(near[0]))
    return sorted(found)


@dataclasses.dataclass(frozen=True)
class _Writer:
    data: GonioData
    draft: Draft
    assumed: frozenset[str]
    wavelengths: list[float]
    shape: tuple[float, ...] = ()

    def head(self) -> Iterator[str]:
        """What the measurement contains, and the top of the file."""
        data = self.data
        source = _printable(data.source or "a measurement")
        yield f"# Sample file for {source}, written by jaxink init. Every key: docs/manual/sample-file.md."
        yield "# Lines that say ASSUMED are usual values, not knowledge: correct them."
        yield "#"
        sides = " and ".join(sorted(set(data.side.tolist())))
        yield f"# The measurement has {len(data)} rows with side {sides},"
        yield f"# incidence at {_listed(data.theta_i_deg)} degrees,"
        yield f"# wavelengths {_listed(data.wavelength_nm)} nm."
        yield f"schema_version = {SCHEMA_VERSION}"
        yield f"title = {json.dumps(source, ensure_ascii=False)}"
        if len(self.wavelengths) < np.unique(data.wavelength_nm).size:
            yield "# Rows with other wavelengths are left out; each wavelength has its own coefficients."
        yield f"wavelength_nm = {_numbers(self.wavelengths)}"
        yield ""
        yield "# Layers in the order in which light meets them; air in front and behind."
        if "order" in self.assumed and len(self.draft.layers) > 1:
            yield f"# ASSUMED: light meets the {self.draft.layers[0]} first; if not, exchange the two tables."

    def plate(self) -> Iterator[str]:
        """The clear layer."""
        yield from ("[[layers]]", 'name = "plate"', 'kind = "clear"')
        yield self._fixed("refractive_index", "plate_index")
        yield self._fixed("thickness_mm", "plate_mm")
        yield from ("absorption_per_mm = 0", "")

    def ink(self) -> Iterator[str]:
        """The scattering layer, with the free parameters."""
        draft = self.draft
        yield from ("[[layers]]", 'name = "ink"', 'kind = "scattering"')
        yield f'phase_function = "{draft.phase_function}"{self._remark("phase_function")}'
        yield self._fixed("refractive_index", "ink_index")
        yield "# The data rarely tell the thickness from the coefficients: measure it, or give it a prior."
        yield self._fixed("thickness_um", "ink_um")
        yield "# Free parameters: value is the start, min and max the range of the fit."
        if draft.phase_function == "mie":
            yield from self._particles()
        else:
            yield from self._coefficients()
        if draft.phase_function in _HAVE_ASYMMETRY:
            yield "# Mean cosine of the scattering angle: 0 scatters evenly, towards 1 forwards."
            each = self.draft.asymmetry == ASYMMETRIES[1] and len(self.wavelengths) > 1
            if len(self.wavelengths) > 1:
                yield f"# {_OF_ASYMMETRY[draft.asymmetry]}{self._remark('asymmetry').replace('  #', ';')}"
            yield _free("asymmetry_parameter", _START_ASYMMETRY, -0.9, 0.98, each)
        if draft.phase_function.startswith("two_term"):
            yield _free("second_asymmetry_parameter", -0.3, -0.9, 0.5, each)
            yield _free("second_weight", 0.1, 0, 1)
        yield ""

    def _coefficients(self) -> Iterator[str]:
        several = len(self.wavelengths) > 1
        if self.draft.ink_um == OPAQUE:
            yield "# The layer is opaque, so only scattering / (scattering + absorption) matters."
            yield _free("single_scattering_albedo", 0.95, 0.01, 1, several)
            return
        thickness_mm = float(self.draft.ink_um) / 1000
        low, high = (_rounded(limit / thickness_mm) for limit in _OPTICAL_THICKNESS)
        starts = [
            min(max(_rounded(reduced_thickness(self.data, w) / thickness_mm * self._per_reduced), low), high)
            for w in self.wavelengths
        ]
        yield "# Scattering coefficient, 1/mm; the start is a rough estimate from the measured values."
        most = _rounded(_ABSORBED / thickness_mm)
        if self.shape:
            yield "# Its shape is that of the diffuse reflectance; its mean and one absorption are free."
            start = _rounded(float(np.mean(starts)))
            yield _free("scattering_per_mm", start, low, high, shape=self.shape)
            yield _free("absorption_per_mm", _rounded(most / 500), 0, most)
            return
        yield _free("scattering_per_mm", starts if several else starts[0], low, high, several)
        yield "# Absorption coefficient, 1/mm."
        yield _free("absorption_per_mm", _rounded(most / 500), 0, most, several)

    @property
    def _per_reduced(self) -> float:
        """Scattering over reduced scattering at the start."""
        return 1.0 if self.draft.phase_function == "rayleigh" else 1 / (1 - _START_ASYMMETRY)

    def _particles(self) -> Iterator[str]:
        draft = self.draft
        yield "# Radius of the spheres, nm, and their share of the volume."
        radius = draft.radius_nm
        yield _free("radius_nm", radius, _rounded(radius / 4), _rounded(radius * 4)) + self._remark(
            "radius_nm"
        )
        yield _free("volume_fraction", 0.05, 0.0005, 0.6)
        yield self._fixed("particle_index", "particle_index")
        several = len(self.wavelengths) > 1
        yield "# Imaginary part of the particles' index."
        if self.shape:
            yield "# Its shape follows from the diffuse reflectance; the mean is free."
            yield _free("particle_absorption_index", 1e-4, 0, 0.5, shape=self.shape)
            return
        yield _free("particle_absorption_index", 1e-4, 0, 0.5, several)

    def _fixed(self, key: str, field: str) -> str:
        value = getattr(self.draft, field)
        shown = f'"{value}"' if isinstance(value, str) else f"{value:.10g}"
        return f"{key} = {shown}{self._remark(field)}"

    def _remark(self, field: str) -> str:
        return f"  # ASSUMED (--{field.replace('_', '-')})" if field in self.assumed else ""


def reduced_thickness(data: GonioData, wavelength_nm: float) -> float:
    """Rough reduced optical thickness of a sample, between 0.05 and 10.

    The total reflectance or, without reflection, transmittance is pi times the median BSDF; the rest follows
    from two-stream theory without absorption, R = 3/4 t / (1 + 3/4 t). Only good enough to start a fit.
    """
    here = (data.wavelength_nm == wavelength_nm) & (data.bsdf_per_sr > 0)
    reflected = here & ~data.is_transmission
    chosen = reflected if reflected.any() else here
    total = math.pi * float(np.median(data.bsdf_per_sr[chosen])) if chosen.any() else 0.5
    share = min(max(total, 0.01), 0.9)
    reflectance = share if reflected.any() else 1 - share
    return min(max(4 / 3 * reflectance / (1 - reflectance), 0.05), 10.0)


def _noise(data: GonioData) -> Iterator[str]:
    """The table of the noise: from the file, estimated, or guessed."""
    yield "[noise]"
    if data.sigma_per_sr is not None:
        yield "# The noise of each point is the column sigma_per_sr of the measurement."
    else:
        estimate = estimate_noise(data)
        pairs = max((s.pairs for s in estimate.sources if s.name == estimate.adopted), default=0)
        if estimate.model is not None and pairs >= MINIMUM_PAIRS:
            yield "# Without sigma_per_sr, a fit estimates the noise from the values themselves:"
            yield f"# {_printable(estimate.sentence)}"
            yield "# To declare it instead:"
            yield f"# relative = {_rounded(estimate.model.relative)}"
        else:
            yield "# ASSUMED: the measurement has neither sigma_per_sr nor values to estimate the noise from."
            yield "# Correct it, because chi-square and all standard errors depend on it."
            typical = float(np.median(np.abs(data.bsdf_per_sr[data.bsdf_per_sr != 0])))
            yield f"relative = {_GUESSED_NOISE}"
            yield f"floor_per_sr = {_rounded(1e-3 * typical):g}"
    yield "# Unknown common factor of each scan (lamp, alignment), relative; 0 if there is none."
    yield "# scan_relative = 0.005"
    yield ""


_OPTIONAL = (
    "# What else may matter; remove the '#' in front of what you know.",
    "# [instrument]",
    "# source_half_angle_deg = 0.25",
    "# detector_half_angle_deg = 0.5",
    "# beam_diameter_mm = 5",
    "# detector_diameter_mm = 20",
    "# [backing]",
    "# reflectance = 0.02",
    '# side = "R"',
    "# [masks]",
    "# specular_half_angle_deg = 2.5",
    "# grazing_theta_o_deg = 80",
)


def _free(
    key: str,
    value: Any,
    low: float,
    high: float,
    per_wavelength: bool = False,
    shape: Sequence[float] = (),
) -> str:
    start = _numbers(value) if isinstance(value, list) else f"{value:g}"
    each = "per_wavelength = true, " if per_wavelength else ""
    each += f"shape = [{', '.join(f'{one:.5g}' for one in shape)}], " if shape else ""
    return f"{key} = {{ {each}value = {start}, free = true, min = {low:g}, max = {high:g} }}"


def _numbers(values: Sequence[float]) -> str:
    """One number, or a list."""
    listed = ", ".join(f"{value:.10g}" for value in values)
    return listed if len(values) == 1 else f"[{listed}]"


def _listed(values: np.ndarray) -> str:
    """Distinct values, shortened if they are many."""
    distinct = [f"{value:g}" for value in np.unique(values).tolist()]
    if len(distinct) > 12:
        return f"{', '.join(distinct[:5])} ... {distinct[-1]} ({len(distinct)})"
    return ", ".join(distinct)


def _rounded(value: float) -> float:
    """Two digits."""
    return float(f"{value:.2g}")


def _printable(text: str) -> str:
    """A text for one line of the file."""
    return "".join(c if c.isprintable() else "?" for c in text)

"""The menu: measurements that one may add to those of a fit."""

import dataclasses
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np

from jaxink.display.brief import brief_repr
from jaxink.measurement import GonioData, Readings
from jaxink.projects import Measurement, Project
from jaxink.sample import Backing, Parameter, ParameterTable, Sample, opposite_medium, turned_over

NEXT = "next"
# Reflectances of usual cards, and the index of an immersion liquid on glass.
_BLACK, _WHITE, _LIQUID = 0.04, 0.85, 1.5
_INCIDENCES_DEG, _APART_DEG = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0), 7.5
_VIEW_DEG = np.arange(-85.0, 86.0, 5.0)
# Directions this close to a regular peak or to the source are skipped.
_NEAR_DEG = 4.0
# Of another print, and of the light for particles whose indices are taken as constant.
_THICKNESSES, _WAVELENGTHS = (0.5, 2.0), (0.8, 1.25)


@dataclasses.dataclass(frozen=True)
class Candidate:
    """A measurement that may be made.

    Parameters
    ----------
    name
        Short, for a file.
    words
        For the user: what to measure.
    measurement
        Its sample and its directions, or readings; the values are not used.
    changes
        What differs from the present sample, for a project file.
    lit_side
        The layer that is lit; empty: that of the base.
    base
        Name of the present measurement whose sample it takes over, but for the changes.
    """

    __repr__ = brief_repr

    name: str
    words: str
    measurement: Measurement
    changes: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    lit_side: str = ""
    base: str = ""


def menu(base: Measurement, project: Project) -> Iterator[Candidate]:
    """Measurements that may be added.

    Parameters
    ----------
    base
        A measurement of a BSDF, whose sample, sides and wavelengths the others take over.
    project
        All present measurements; what they have already is left out.
    """
    read = {q for one in project.measurements if isinstance(one.data, Readings) for q in one.data.quantity}
    fronts = {one.sample.layers[0].name for one in project.measurements if isinstance(one.data, GonioData)}
    data, sample = base.data, base.sample
    assert isinstance(data, GonioData)
    measured = np.unique(data.theta_i_deg[data.used])
    usual = float(measured[np.argmin(np.abs(measured - 30.0))])

    def bsdf(name, words, changed=sample, names=None, theta_i=usual, phi=180.0, sides=None, **more):
        at = _plane(data, theta_i, phi, sides)
        given = base.names if names is None else names
        return Candidate(name, words, Measurement(NEXT, at, changed, given), base=base.name, **more)

    for angle in _INCIDENCES_DEG:
        if np.min(np.abs(measured - angle)) > _APART_DEG:
            yield bsdf(f"incidence_{angle:g}", f"the plane of incidence at {angle:g} degrees", theta_i=angle)
    if np.all(np.isin(np.rint(np.abs(data.phi_deg[data.used])), (0, 180))):
        steepest = float(measured[-1])
        words = f"the plane normal to that of incidence, at {steepest:g} degrees"
        yield bsdf("out_of_plane", words, theta_i=steepest, phi=90.0)
    turned = turned_over(sample)
    if turned is not None and not sample.layers[-1].opaque and turned.layers[0].name not in fronts:
        names = {opposite_medium(own): name for own, name in base.names.items()}
        side = turned.layers[0].name
        yield bsdf("other_side", f"lit on the other side ({side})", turned, names, lit_side=side)
    yield from _prints(bsdf, base)
    yield from _cards(bsdf, sample, base.names)
    yield from _immersed(bsdf, sample, base.names)
    yield from _wavelengths(base)
    yield from _readings(base, read)


def _prints(bsdf, base: Measurement) -> Iterator[Candidate]:
    """Other prints of the ink, of known thickness."""
    for layer in base.sample.layers:
        name = f"{layer.name}.thickness_um"
        if not layer.scatters or layer.opaque or name not in base.sample.parameters:
            continue
        for factor in _THICKNESSES:
            value = factor * base.sample.parameters[name].value
            table = base.sample.parameters.replace(
                name, value=value, free=False, tie=None, prior=None, minimum=0.0, maximum=np.inf
            )
            sample = dataclasses.replace(base.sample, parameters=table)
            names = {**base.names, name: f"{NEXT}/{name}"}
            words = f"a print of {layer.name} of known thickness, about {value:.3g} um"
            changes = {layer.name: {"thickness_um": value}}
            yield bsdf(f"thickness_{value:.0f}_um", words, sample, names, changes=changes)


def _cards(bsdf, sample: Sample, names: Mapping[str, str]) -> Iterator[Candidate]:
    """A card behind the sample, or none."""
    if sample.layers[-1].opaque:
        return
    if sample.backing is not None:
        rest = [p for p in sample.parameters.values() if not p.name.startswith("backing.")]
        bare = dataclasses.replace(sample, backing=None, parameters=ParameterTable(rest))
        yield bsdf("no_card", "nothing behind the sample", bare, names, changes={"backing": False})
        return
    for word, reflectance in (("black", _BLACK), ("white", _WHITE)):
        own = Parameter("backing.reflectance", reflectance, minimum=0.0, maximum=1.0)
        table = ParameterTable([*sample.parameters.values(), own])
        card = dataclasses.replace(sample, backing=Backing("R", False), parameters=table)
        known = {**names, own.name: f"{NEXT}/{own.name}"}
        words = f"a {word} card of known reflectance ({reflectance:g}) behind the sample, in reflection"
        changes = {"backing": {"reflectance": reflectance}}
        yield bsdf(f"over_{word}", words, card, known, sides=(False,), changes=changes)


def _immersed(bsdf, sample: Sample, names: Mapping[str, str]) -> Iterator[Candidate]:
    """The back face in a liquid, which takes its reflection away."""
    name = "surroundings.index_back"
    if sample.layers[-1].opaque or not sample.parameters[name].is_fixed or sample.backing is not None:
        return
    table = sample.parameters.replace(name, value=_LIQUID, minimum=1.0, maximum=4.0)
    wet = dataclasses.replace(sample, parameters=table)
    words = f"the back face in a liquid of index {_LIQUID:g}, in reflection"
    changes = {"surroundings": {"index_back": _LIQUID}}
    known = {**names, name: f"{NEXT}/{name}"}
    yield bsdf("immersed", words, wet, known, sides=(False,), changes=changes)


def _wavelengths(base: Measurement) -> Iterator[Candidate]:
    """Another wavelength, for particles whose indices are the same there."""
    sample, data = base.sample, base.data
    assert isinstance(data, GonioData)
    of_particles = any(layer.phase_function == "mie" for layer in sample.layers)
    waves = np.unique(data.wavelength_nm[data.used])
    if not of_particles or len(waves) > 1 or any("@" in name for name in sample.parameters):
        return
    for factor in _WAVELENGTHS:
        wave = float(np.rint(factor * waves[0] / 5) * 5)
        at = _plane(data, float(np.min(data.theta_i_deg[data.used])), 180.0, None)
        at = at.replace(wavelength_nm=np.full(len(at), wave))
        other = dataclasses.replace(sample, wavelengths_nm=(wave,) if sample.wavelengths_nm else ())
        words = f"light of {wave:g} nm, if the refractive indices are the same there"
        changes = {"wavelength_nm": wave}
        measurement = Measurement(NEXT, at, other, base.names)
        yield Candidate(f"{wave:g}_nm", words, measurement, changes, base=base.name)


def _readings(base: Measurement, read: Collection[str]) -> Iterator[Candidate]:
    """Totals of an integrating sphere, and collimated light."""
    if base.sample.effects:
        return
    assert isinstance(base.data, GonioData)
    waves = np.unique(base.data.wavelength_nm[base.data.used])
    is_opaque = base.sample.layers[-1].opaque
    totals = ("R_total",) if is_opaque else ("R_total", "T_total")
    if not {*totals} <= {*read}:
        words = "total reflectance and transmittance, integrating sphere"
        yield _of_quantities(base, "totals", words, totals, waves)
    if not is_opaque and "T_collimated" not in read:
        yield _of_quantities(base, "collimated", "collimated transmittance", ("T_collimated",), waves)


def _of_quantities(base: Measurement, name: str, words: str, quantities, waves) -> Candidate:
    pairs = [(quantity, wave) for quantity in quantities for wave in waves]
    size = len(pairs)
    incidence = np.array([0.0 if quantity == "T_collimated" else 8.0 for quantity, _ in pairs])
    data = Readings(
        np.array([quantity for quantity, _ in pairs]),
        incidence,
        np.full(size, np.nan),
        np.full(size, np.nan),
        np.array([wave for _, wave in pairs]),
        np.full(size, 0.5),
    )
    return Candidate(name, words, Measurement(NEXT, data, base.sample, base.names), base=base.name)


def _plane(data: GonioData, theta_i: float, phi: float, sides: tuple[bool, ...] | None) -> GonioData:
    """Views in a plane at one incidence, on the sides and at the wavelengths of the data."""
    used = data.used
    settings = np.unique(np.column_stack([data.wavelength_nm[used], data.is_transmission[used]]), axis=0)
    rows = []
    for wavelength, side in settings:
        if sides is not None and bool(side) not in sides:
            continue
        for view in _VIEW_DEG:
            if phi == 180.0 and abs(abs(view) - theta_i) < _NEAR_DEG:
                continue
            rows.append((theta_i, abs(view), phi if view >= 0 else phi - 180.0, wavelength, bool(side)))
    theta, view, azimuth, wavelength, is_transmission = map(np.array, zip(*rows, strict=True))
    ones = np.ones(len(rows))
    return GonioData(theta, view, azimuth, wavelength, is_transmission, ones, source="planned")

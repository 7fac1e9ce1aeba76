"""Simulated measurements of the cases, by the Monte Carlo and noise from a seed, and their sample files."""

import json
import zlib
from dataclasses import replace
from pathlib import Path

import miepython
import numpy as np

import jaxink
from benchmarks.montecarlo import (
    Detectors,
    Facets,
    HenyeyGreenstein,
    Layer,
    Result,
    Sample,
    Tabulated,
    simulate,
)
from benchmarks.validation.names.cases import INCIDENCES_DEG, WAVELENGTH_NM, Case, Ink

MEASUREMENTS = Path(__file__).with_name("measurements")
# Photons are followed in rounds until the median standard error is small, or there are this many.
_IN_ROUND, _MOST_ROUNDS, _STANDARD_ERROR = 100_000, 30, 0.0025
# Transmission through a rough face: photons of each direction of view, see `through_rough_face`.
_PHOTONS_BACK = 300_000
# The Monte Carlo's own error, which directions of an incidence share, is declared as that of a scan.
_RELATIVE, _FLOOR_PER_SR, _SCAN_RELATIVE = 0.005, 1e-4, 0.004
_STEP_DEG, _LAST_DEG = 2.5, 85.0
# Rows nearer to a regular peak, and to the source, are absent.
_PEAK_DEG, _SOURCE_DEG = 2.5, 4.0
# Points of the tables of phase functions, and of radii, with their range in standard deviations.
_COSINES, _RADII, _DEVIATIONS = 2001, 121, 5.0
_STRUCTURE_NODES = 4001


def directions(theta_i_deg: float) -> Detectors:
    """Directions of view at one incidence: the plane of incidence, both sides."""
    signed = np.arange(-_LAST_DEG, _LAST_DEG + _STEP_DEG / 2, _STEP_DEG)
    reflected = signed[
        (np.abs(signed - theta_i_deg) > _PEAK_DEG) & (np.abs(signed + theta_i_deg) > _SOURCE_DEG)
    ]
    transmitted = signed[np.abs(signed - theta_i_deg) > _PEAK_DEG]
    both = np.concatenate([reflected, transmitted])
    is_transmission = np.repeat([False, True], [reflected.size, transmitted.size])
    return Detectors(np.abs(both), np.where(both < 0, 0.0, 180.0), is_transmission)


def layer_of(ink: Ink) -> Layer:
    """The ink with its optical coefficients, those of spheres by miepython."""
    thickness_mm = 1e-3 * ink.thickness_um
    if ink.asymmetry is not None:
        phase = HenyeyGreenstein(ink.asymmetry)
        return Layer(ink.index, thickness_mm, ink.scattering_per_mm, ink.absorption_per_mm, phase)
    scattering, absorption, phase = _of_spheres(ink)
    return Layer(ink.index, thickness_mm, scattering, absorption, phase)


def _of_spheres(ink: Ink) -> tuple[float, float, Tabulated]:
    """Scattering and absorption per mm, and the phase function, averaged over the radii by number."""
    spread = np.log(ink.size_ratio)
    if spread > 0:
        nodes, weights = np.polynomial.legendre.leggauss(_RADII)
        # Scattering grows with the sixth power of a small radius, which moves its weight upwards.
        low, high = -_DEVIATIONS, _DEVIATIONS + 6 * spread
        z = 0.5 * (low + high) + 0.5 * (high - low) * nodes
        radii_nm, shares = ink.radius_nm * np.exp(spread * z), weights * np.exp(-(z**2) / 2)
    else:
        radii_nm, shares = np.array([ink.radius_nm]), np.ones(1)
    shares /= shares.sum()
    index = complex(ink.particle_index, -ink.particle_absorption_index) / ink.index
    cosines = np.linspace(-1, 1, _COSINES)
    scattered, absorbed, volume = np.zeros(_COSINES), 0.0, 0.0
    for radius_nm, share in zip(radii_nm, shares, strict=True):
        size = 2 * np.pi * radius_nm * ink.index / WAVELENGTH_NM
        q_ext, q_sca, *_ = miepython.efficiencies_mx(index, size)
        area_mm2 = np.pi * (radius_nm * 1e-6) ** 2
        scattered += share * area_mm2 * q_sca * miepython.i_unpolarized(index, size, cosines, norm="one")
        absorbed += share * area_mm2 * (q_ext - q_sca)
        volume += share * 4 / 3 * np.pi * (radius_nm * 1e-6) ** 3
    if ink.is_dense:
        scattered *= hard_sphere_structure(ink, cosines)
    number_per_mm3 = ink.volume_fraction / volume
    total = 2 * np.pi * np.trapezoid(scattered, cosines)
    return number_per_mm3 * total, number_per_mm3 * absorbed, Tabulated(cosines, scattered)


def hard_sphere_structure(ink: Ink, cosines: np.ndarray) -> np.ndarray:
    """Static structure factor of hard spheres, from their direct correlation function by quadrature.

    References
    ----------
    Wertheim 1963 Phys. Rev. Lett. 10, 321: c(s) = -(a + 6 eta b s + eta a s^3 / 2) for s < 1 in diameters.
    """
    eta = ink.volume_fraction
    a, b = (1 + 2 * eta) ** 2 / (1 - eta) ** 4, -((1 + eta / 2) ** 2) / (1 - eta) ** 4
    s = np.linspace(0, 1, _STRUCTURE_NODES)
    correlation = -(a + 6 * eta * b * s + eta / 2 * a * s**3)
    wave = 4 * np.pi * ink.index / WAVELENGTH_NM * np.sqrt((1 - cosines) / 2)
    product = wave[:, None] * 2 * ink.radius_nm * s
    transform = 4 * np.pi * np.trapezoid(correlation * s**2 * np.sinc(product / np.pi), s, axis=1)
    density = 6 * eta / np.pi
    return 1 / (1 - density * transform)


def draw(case: Case) -> dict:
    """BSDF without noise at all rows, and its standard error from the Monte Carlo."""
    plate = Layer(case.plate_index, case.plate_mm)
    sample = Sample((plate, layer_of(case.ink)))
    if case.sigma_deg is not None:
        sample = replace(sample, faces=(None, None, Facets("cauchy", np.tan(np.deg2rad(case.sigma_deg)))))
    if case.field_diameter_mm is not None:
        radii = {"beam_radius_mm": case.beam_diameter_mm / 2, "seen_radius_mm": case.field_diameter_mm / 2}
        sample = replace(sample, **radii)
    transmitted = through_rough_face(sample, case.name) if case.sigma_deg is not None else None
    means, errors = [], []
    for number, theta_i_deg in enumerate(INCIDENCES_DEG):
        seed = zlib.crc32(f"{case.name} {number}".encode())
        seen = directions(theta_i_deg)
        if case.backing is None and transmitted is None:
            parts = [followed(sample, theta_i_deg, seed, seen)]
        else:
            # The backing is there while reflection is measured.
            lit = replace(sample, backing_albedo=case.backing)
            parts = [followed(lit, theta_i_deg, seed, only(seen, False))]
            if transmitted is None:
                parts.append(followed(sample, theta_i_deg, seed, only(seen, True)))
            else:
                parts.append(rows_at(transmitted, number, only(seen, True)))
        for mean, error in parts:
            means.append(case.gain * mean)
            errors.append(case.gain * error)
    return {
        "bsdf_per_sr": [float(f"{value:.5g}") for value in np.concatenate(means)],
        "standard_error_per_sr": [float(f"{error:.2g}") for error in np.concatenate(errors)],
    }


def through_rough_face(sample: Sample, name: str) -> dict[tuple[float, float], tuple]:
    """BTDF at the incidences, with standard errors, by direction of view (polar angle, azimuth).

    Photons go back from each direction of view to the detectors that stand at the incidences, as Helmholtz
    reciprocity allows: the last event before a detector is then a scattering in the ink, not a facet that
    happens to stand right, and no two directions of view share their photons. Sent forwards, their errors of
    0.5 % were shared by neighbouring directions and looked like structure.
    """
    turned = replace(sample, layers=sample.layers[::-1], faces=sample.faces[::-1])
    incidences, azimuths_deg = np.array(INCIDENCES_DEG), (0.0, 180.0)
    detectors = Detectors(
        np.tile(incidences, 2), np.repeat(azimuths_deg, incidences.size), np.ones(2 * incidences.size, bool)
    )
    found = {}
    for theta_deg in np.arange(0.0, _LAST_DEG + _STEP_DEG / 2, _STEP_DEG):
        seed = zlib.crc32(f"{name} back {theta_deg:g}".encode())
        batches = simulate(turned, theta_deg, _PHOTONS_BACK, seed, detectors).bsdf
        mean, error = Result.mean_and_error(batches)
        for k, phi_deg in enumerate(azimuths_deg):
            which = slice(k * incidences.size, (k + 1) * incidences.size)
            found[float(theta_deg), phi_deg] = mean[which], error[which]
    return found


def rows_at(transmitted: dict, number: int, detectors: Detectors) -> tuple[np.ndarray, np.ndarray]:
    """Rows of one incidence."""
    rows = zip(detectors.theta_deg.tolist(), detectors.phi_deg.tolist(), strict=True)
    mean, error = np.array([[part[number] for part in transmitted[row]] for row in rows]).T
    return mean, error


def followed(sample: Sample, theta_i_deg: float, seed: int, detectors: Detectors):
    """Mean and standard error of the BSDF of as many photons as it needs."""
    rounds = []
    while len(rounds) < _MOST_ROUNDS:
        rounds.append(simulate(sample, theta_i_deg, _IN_ROUND, seed + len(rounds), detectors).bsdf)
        mean, error = Result.mean_and_error(np.mean(rounds, axis=0))
        if np.median(error / mean) < _STANDARD_ERROR:
            break
    return mean, error


def only(detectors: Detectors, is_transmission: bool) -> Detectors:
    """The directions of one side."""
    kept = detectors.is_transmission == is_transmission
    return Detectors(detectors.theta_deg[kept], detectors.phi_deg[kept], detectors.is_transmission[kept])


def measurement(case: Case) -> jaxink.GonioData:
    """The measurement with its noise, whose seed is that of the case."""
    values = np.array(drawn(case)["bsdf_per_sr"])
    seen = [directions(theta) for theta in INCIDENCES_DEG]
    is_transmission = np.concatenate([view.is_transmission for view in seen])
    sigma = np.hypot(_RELATIVE * values, _FLOOR_PER_SR)
    # What each direction has of its own is noise that the Monte Carlo has added already.
    declared = sigma
    if case.sigma_deg is not None:
        own = np.where(is_transmission, drawn(case)["standard_error_per_sr"], 0.0)
        declared = np.hypot(sigma, own)
    random = np.random.default_rng(zlib.crc32(f"{case.name} noise".encode()))
    theta_i, sizes = np.array(INCIDENCES_DEG), [view.theta_deg.size for view in seen]
    return jaxink.GonioData(
        theta_i_deg=np.repeat(theta_i, sizes),
        theta_o_deg=np.concatenate([view.theta_deg for view in seen]),
        phi_deg=np.concatenate([view.phi_deg for view in seen]),
        wavelength_nm=np.full(values.size, WAVELENGTH_NM),
        is_transmission=is_transmission,
        bsdf_per_sr=values + sigma * random.standard_normal(values.size),
        sigma_per_sr=declared,
    )


def drawn(case: Case) -> dict:
    """What `draw` made, kept in a file."""
    file = MEASUREMENTS / f"{case.name}.json"
    if not file.exists():
        MEASUREMENTS.mkdir(exist_ok=True)
        file.write_text(json.dumps(draw(case)) + "\n", encoding="utf-8")
    return json.loads(file.read_text(encoding="utf-8"))


def sample_text(case: Case) -> str:
    """Sample file of one who knows nothing of the undeclared effects."""
    ink = case.ink
    if ink.asymmetry is not None:
        scattering = [
            'phase_function = "henyey_greenstein"',
            "scattering_per_mm = { free = true, min = 1, max = 1000 }",
            "absorption_per_mm = { free = true, min = 0, max = 50 }",
            "asymmetry_parameter = { free = true, min = -0.9, max = 0.95 }",
        ]
    else:
        fraction = ink.volume_fraction if ink.is_dense else "{ free = true, min = 0.002, max = 0.5 }"
        scattering = [
            'phase_function = "mie"',
            "radius_nm = { free = true, min = 80, max = 600 }",
            f"volume_fraction = {fraction}",
            f"particle_index = {ink.particle_index}",
            "particle_absorption_index = { free = true, min = 0, max = 0.01 }",
        ]
    lines = [
        "schema_version = 1",
        f'title = "simulated: {case.name}"',
        f"wavelength_nm = [{WAVELENGTH_NM:g}]",
        "",
        "[[layers]]",
        'name = "plate"',
        'kind = "clear"',
        f"refractive_index = {case.plate_index}",
        f"thickness_mm = {case.plate_mm}",
        "absorption_per_mm = 0.0",
        "",
        "[[layers]]",
        'name = "ink"',
        'kind = "scattering"',
        *scattering,
        f"refractive_index = {ink.index}",
        f"thickness_um = {ink.thickness_um}",
        "",
        "[noise]",
        f"relative = {_RELATIVE}",
        f"floor_per_sr = {_FLOOR_PER_SR}",
        f"scan_relative = {_SCAN_RELATIVE}",
        "",
        "# The rows near the regular peaks and near the source are absent.",
        "[masks]",
        "specular_half_angle_deg = 0",
        "undeviated_half_angle_deg = 0",
        "retro_half_angle_deg = 0",
    ]
    return "\n".join(lines) + "\n"

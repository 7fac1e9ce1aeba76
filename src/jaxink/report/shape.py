"""Section of the report on the shape of the remaining residual."""

from typing import TYPE_CHECKING

from jaxink.display.html import paragraph, table
from jaxink.numerics.digits import with_uncertainty
from jaxink.report.html import Section, chance, number, section, share, tables

if TYPE_CHECKING:
    from jaxink.diagnosis import Diagnosis
    from jaxink.residual import ModeShare

_MODES = (
    "Amplitude: relative deviation of the measurement from the model where both directions graze. Modes: "
    "products of Zernike polynomials of the sines of both polar angles with the cosine of a multiple of phi "
    "(Legendre polynomials of the signed sines in the plane of incidence), symmetric in both directions in "
    "reflection. Δχ²: decrease when the mode was added to those above it."
)
_SYMMETRY = (
    "What no isotropic, reciprocal sample has: smooth differences between residuals at directions at which "
    "the model is equal (p: F test against the scatter of the other differences)."
)
_OVERLAPS = (
    "Overlap: cosine between the change that an effect causes and the modes above, both without what the "
    "free parameters reproduce; 1 if the effect has this shape."
)
_PAIRS = {"mirror": "+phi and -phi", "reciprocal": "source and detector exchanged"}


def shape(diagnosis: "Diagnosis") -> Section | None:
    """Smooth modes of the remaining residual, and the overlap of other effects with them."""
    found = diagnosis.shape
    if found is None:
        return None
    parts = list[str]()
    if found.modes:
        heads = ["side", "order in incidence", "order in view", "azimuth", "Δχ²", "amplitude(s.e.)"]
        parts += [table(heads, map(_mode_cells, found.modes), (0, 3)), paragraph(_MODES)]
    heads = ["modes up to order", "amplitudes", "χ² carried", "share of the excess over noise"]
    excess = max(found.excess, 1e-300)
    orders = (
        [str(o.order), str(o.amplitudes), number(o.chi_square), share((o.chi_square - o.amplitudes) / excess)]
        for o in found.orders
    )
    parts.append(table(heads, orders, ()))
    heads = ["side", "incidence", "wavelength", "points", "χ²", "χ² without the modes", "rms of the modes"]
    scans = (
        [s.side, f"{s.theta_i_deg:g}°", f"{s.wavelength_nm:g} nm", str(s.points), number(s.chi_square)]
        + [number(s.chi_square_left), share(s.relative_rms)]
        for s in found.scans
    )
    parts.append(tables(heads, scans))
    if found.asymmetries:
        heads = ["difference between", "pairs", "modes", "χ² carried", "p", "rms of a reading"]
        broken = (
            [_PAIRS[a.kind], str(a.pairs), str(a.modes), number(a.chi_square), chance(a.p_value)]
            + [share(a.relative_rms)]
            for a in found.asymmetries
        )
        parts += [paragraph(_SYMMETRY), table(heads, broken)]
    if diagnosis.overlaps:
        heads = ["effect that was not added", "overlap"]
        overlaps = ([name, f"{value:+.2f}"] for name, value in diagnosis.overlaps.items())
        parts += [paragraph(_OVERLAPS), tables(heads, overlaps)]
    return section("Shape of the remaining residual", *parts)


def _mode_cells(found: "ModeShare") -> list[str]:
    mode = found.mode
    azimuth = "in plane" if mode.azimuthal_order is None else f"cos {mode.azimuthal_order} phi"
    each = zip(found.wavelength_nm, found.amplitude, found.standard_error, strict=True)
    amplitudes = [(nm, with_uncertainty(float(a), float(error))) for nm, a, error in each]
    words = "; ".join(f"{nm:g} nm: {text}" for nm, text in amplitudes)
    if len(amplitudes) == 1:
        words = amplitudes[0][1]
    return [mode.side, str(mode.n), str(mode.m), azimuth, number(found.chi_square), words]

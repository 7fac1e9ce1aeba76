"""The page of a fit: verdict, layers, five numbers and one picture; everything else as details."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING

from jaxink.colour import ColoursAtPoints, colours_if_any, display_code, shown_colour
from jaxink.display.html import paragraph, table
from jaxink.fitting import OVER_MINIMA, merit_table, rejected, rejection
from jaxink.numerics.digits import percent, plain, rounded, with_uncertainty
from jaxink.numerics.failures import Failure
from jaxink.plots import (
    SIDES,
    measurement_name,
    overview_words,
    residual_words,
    used_wavelengths,
    wavelength_words,
    worst_wavelength,
)
from jaxink.report import html
from jaxink.report.layer_sketch import layer_sketch
from jaxink.report.sections import measured_words, missing_parts
from jaxink.report.suggestions import NextStep

if TYPE_CHECKING:
    from jaxink.fitting import FitResult, Minima


OVERVIEW = "overview"
SPECTRUM = "spectrum"
_NUMBERS = 5
# Of the ink, in words, with their units; the first of the numbers that matter.
_OF_THE_INK = {
    "scattering_per_mm": ("scattering coefficient", "1/mm"),
    "absorption_per_mm": ("absorption coefficient", "1/mm"),
    "asymmetry_parameter": ("asymmetry parameter g", ""),
}
_QUANTITIES = _OF_THE_INK | {
    "reduced_scattering_per_mm": ("scattering (1 - g)", "1/mm"),
    "reduced_optical_thickness": ("scattering (1 - g) times thickness", ""),
}
_SPECTRUM_WORDS = (
    "Optical properties and other free parameters against the wavelength, with standard errors where they "
    "hold, and the misfit at each wavelength."
)
_SCANS = {
    "cuts": "Measured and fitted BSDF in the plane of incidence",
    "residual_map": "Residuals over all viewing directions",
    "residual_shape": "The relative residual, and the part of it that smooth modes carry",
}
# Larger correlations are listed.
_STRONG = 0.9
_SIDE = 46


def fit_page(
    result: "FitResult",
    drawn: Mapping[str, bytes],
    todo: Sequence[NextStep] = (),
    missing: Sequence[Failure] = (),
    name: str = "",
) -> str:
    """The page of a fit.

    Parameters
    ----------
    result
        The fit.
    drawn
        Its figures as PNG by their names without suffix, `OVERVIEW` among them; those that are absent are
        left out.
    todo
        What to do next.
    missing
        What could not be drawn.
    name
        Of the measurement, for the title; empty: the title of the sample.
    """
    verdict = result.verdict
    parts = [
        html.verdict(verdict.sentence, verdict.code, not verdict.code.needs_warning),
        missing_parts(missing),
        paragraph(measured_words(result)),
        html.beside(layer_sketch(result.sample), html.numbers(five_numbers(result))),
    ]
    if OVERVIEW in drawn:
        parts.append(html.figure(drawn[OVERVIEW], overview_words(result)))
    if SPECTRUM in drawn:
        parts.append(html.figure(drawn[SPECTRUM], _SPECTRUM_WORDS))
    steps = html.commands((step.words, step.command) for step in todo) if todo else ""
    title = f"Fit: {name or measurement_name(result)}"
    return html.document(title, "".join(parts) + steps, (), tuple(_details(result, drawn)))


def five_numbers(result: "FitResult") -> list[tuple[str, str]]:
    """The misfit, and what is known of the ink: optical properties of it, then free parameters.

    Optical properties of several wavelengths are those of the one that is fitted worst.
    """
    merit, holds = result.merit, result.verdict.standard_errors_hold
    found = []
    if merit.reduced_chi_square is not None:
        found.append((rounded(merit.reduced_chi_square, 4), "reduced chi-square; noise alone gives about 1"))
    deviation = result.deviation
    if deviation is not None:
        found.append((percent(deviation.rms), "rms of measured / model - 1"))
    several, wave = len(used_wavelengths(result.data)) > 1, worst_wavelength(result)
    ink = next((layer.name for layer in result.sample.layers if layer.scatters), None)
    told = set()
    for d in result.derived:
        if d.layer == ink and d.quantity in _OF_THE_INK and abs(d.wavelength_nm - wave) < 1e-6:
            words, unit = _OF_THE_INK[d.quantity]
            at = f" at {wave:g} nm" if several else ""
            value = _value(d.value, d.standard_error, holds)
            found.append((_short(value, unit), f"{words} of {ink}{at}"))
            told.add(f"{d.layer}.{d.quantity}")
    for p in result.parameters.free:
        stem, _, at = p.name.partition("@")
        if stem not in told and at in ("", f"{wave:g}"):
            value = _value(p.value, p.standard_error, holds)
            found.append((_short(value, p.unit), p.name))
    return found[:_NUMBERS]


def _value(value: float, error: float | None, holds: bool) -> str:
    return with_uncertainty(value, error) if holds and error else rounded(value, 4)


def _short(value: str, unit: str) -> str:
    return f"{value} {unit}" if unit else value


def _details(result: "FitResult", drawn: Mapping[str, bytes]) -> Iterator[html.Section]:
    parameters = result.card().tables[0]
    yield html.section("Parameters", parameters.html(), html.bullets(_parameter_notes(result)))
    if result.derived:
        yield html.section("Optical properties", _derived(result))
    figures = {name: png for name, png in drawn.items() if name not in (OVERVIEW, SPECTRUM)}
    if figures:
        words = wavelength_words(result.data)
        shown = (html.figure(png, _caption(result, name)) for name, png in figures.items())
        yield html.section("Scans", paragraph(words) if words else "", *shown)
    colours = colours_if_any(result.data, result.predicted_per_sr)
    if colours is not None:
        yield colour_section(colours)
    yield html.section("Figures of merit", merit_table(result.merit, result.deviation).html())
    yield html.section("Misfit by scan", _scans(result))
    if result.correlation_names:
        yield html.section("Correlations", html.bullets(_correlations(result)))
    if result.minima is not None and result.minima.is_told:
        yield html.section("Minima", *_minima(result.minima))
    if result.residual_shape is not None:
        yield html.section("Shape of the residual", paragraph(result.residual_shape.sentence))
    if result.mistakes:
        yield html.section("Mistakes in the input", *_mistakes(result))
    if result.notes:
        yield html.section("Notes", html.bullets(result.notes))
    yield html.section("Searches, settings and versions", _searches(result), html.bullets(_settings(result)))


def _mistakes(result: "FitResult") -> Iterator[str]:
    """Those that the data name, with what to do, and a table of those that were tried and rejected."""
    before = result.verdict.reduced_chi_square
    named = [mistake.sentence(before) for mistake in result.mistakes if mistake.is_named]
    if named:
        yield html.bullets(named)
    tried = rejected(result.mistakes)
    if tried:
        rows = ([one.supposition, rounded(one.reduced_chi_square, 4)] for one in tried)
        yield paragraph("Tried and rejected:")
        yield html.tables(["mistake", "reduced chi-square after"], rows)
        yield paragraph(rejection(result.mistakes, before, is_misfit=result.verdict.is_misfit))


def _caption(result: "FitResult", name: str) -> str:
    """What a figure of `jaxink.plots.figures` shows, by its name, such as ``cuts_R_550nm``."""
    kind, side, wave = name.rsplit("_", 2)
    words = f"{_SCANS[kind]}, in {SIDES[side]} at {wave.removesuffix('nm')} nm."
    below = {"cuts": "Below", "residual_map": "Drawn"}
    return f"{words} {below[kind]}: {residual_words(result)}" if kind in below else words


def _parameter_notes(result: "FitResult") -> Iterator[str]:
    yield "s.e.: standard error in units of the last digits, 1.234(5) = 1.234 +- 0.005."
    if not result.verdict.standard_errors_hold:
        yield "These standard errors are meaningless: they assume that the model fits."
    if any(p.over_minima for p in result.parameters.values()):
        yield OVER_MINIMA
    for p in result.parameters.values():
        if p.interval is not None:
            low, high = p.interval
            yield f"{p.name}: {plain(low)} to {plain(high)} by profile likelihood."


def _derived(result: "FitResult") -> str:
    rows = []
    for d in result.derived:
        words, unit = _QUANTITIES.get(d.quantity, (d.quantity, ""))
        error = d.standard_error if result.verdict.standard_errors_hold else None
        rows.append([d.layer, f"{d.wavelength_nm:g} nm", words, with_uncertainty(d.value, error), unit])
    return html.tables(["layer", "wavelength", "quantity", "value(s.e.)", "unit"], rows, (0, 2, 4))


def _scans(result: "FitResult") -> str:
    heads = ["side", "wavelength", "incidence", "points", "chi-square"]
    heads += ["rms of measured / model - 1", "mean of measured / model - 1"]
    rows = (
        [s.side, f"{s.wavelength_nm:g} nm", f"{s.theta_i_deg:g}°", str(s.points), rounded(s.chi_square, 4)]
        + [percent(one and one.rms), percent(one and one.mean, "+.2g")]
        for s, one in ((s, result.deviation_of(s)) for s in result.scans)
    )
    return html.tables(heads, rows)


def _correlations(result: "FitResult") -> list[str]:
    names, matrix = result.correlation_names, result.correlations
    pairs = [(float(matrix[i, j]), names[j], names[i]) for i in range(len(names)) for j in range(i)]
    strong = sorted((p for p in pairs if abs(p[0]) > _STRONG), key=lambda pair: -abs(pair[0]))
    lines = [f"{one} and {other}: {value:+.3f}" for value, one, other in strong]
    return lines or [f"No correlation exceeds {_STRONG:g}."]


def _minima(minima: "Minima") -> Iterator[str]:
    rows = minima.table()
    yield paragraph(minima.sentence)
    yield html.tables(rows.heads, rows.rows, rows.text_columns)


def _searches(result: "FitResult") -> str:
    rows = (
        [s.method, s.outcome, str(s.jacobians), str(s.evaluations), plain(s.loss_start), plain(s.loss)]
        + [f"{s.run_seconds:.2f} s", f"{s.compile_seconds:.2f} s"]
        for s in result.searches
    )
    heads = ["search", "outcome", "Jacobians", "evaluations", "misfit at start", "misfit at end"]
    return table([*heads, "run time", "compilation"], rows, (0, 1))


def _settings(result: "FitResult") -> list[str]:
    return [
        f"Fit of {result.objective.replace('_', '-')}: {result.method}, {result.outcome.value}; "
        f"seed {result.seed}.",
        f"Resolution: {', '.join(f'{k} {v}' for k, v in result.solver.items())}.",
        f"Versions: {', '.join(f'{k} {v}' for k, v in result.versions.items())}.",
    ]


def swatches(colours: Iterable[tuple[str, str]]) -> str:
    """Squares of colours of a display, each with what it is below."""
    drawn, texts = "", ""
    for k, (code, words) in enumerate(colours):
        x = 90 * k + 4
        drawn += (
            f'<rect x="{x}" y="4" width="{_SIDE}" height="{_SIDE}" fill="{escape(code, quote=True)}" '
            'stroke="#555"/>'
        )
        texts += f'<text x="{x}" y="{_SIDE + 20}">{escape(words)}</text>'
    return f'<svg width="300" height="{_SIDE + 28}" role="img" aria-label="swatches">{drawn}{texts}</svg>\n'


def colour_section(found: ColoursAtPoints) -> html.Section:
    """Differences on each side, and swatches of the direction nearest to 45:0."""
    (table,) = found.card().tables
    parts = [paragraph(found.viewing.sentence), table.html()]
    one = shown_colour(found)
    if one is not None:
        pairs = [("measured", one.measured_lab), ("fitted", one.fitted_lab)]
        parts.append(swatches((display_code(lab), words) for words, lab in pairs))
        labs = "; ".join(f"{words} L* {lab[0]:.2f}, a* {lab[1]:.2f}, b* {lab[2]:.2f}" for words, lab in pairs)
        parts.append(
            paragraph(
                f"Incidence {one.theta_i_deg:g}, view {one.theta_o_deg:g} degrees: {labs}. Shown as a "
                "display with white D65 does, relative to a perfect white in the same light."
            )
        )
    return html.section("Colour", *parts)

"""The page of a fit: verdict, layers, five numbers and one picture; everything else as details."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING

from jaxink.colour import ColoursAtPoints, colours_if_any, display_code, shown_colour
from jaxink.display.card import CardTable
from jaxink.display.html import paragraph
from jaxink.fitting import (
    compilation_sentence,
    correlation_lines,
    derived_table,
    merit_table,
    named_lines,
    parameter_notes,
    rejected_table,
    rejection,
    scan_table,
    search_table,
)
from jaxink.numerics.digits import percent, rounded, with_uncertainty
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
from jaxink.report.sections import masked, measured_words, missing_parts
from jaxink.report.suggestions import NextStep

if TYPE_CHECKING:
    from jaxink.fitting import FitResult


OVERVIEW = "overview"
SPECTRUM = "spectrum"
_NUMBERS = 5
# Of the ink; the first of the numbers that matter.
_OF_THE_INK = ("scattering_per_mm", "absorption_per_mm", "asymmetry_parameter")
_SPECTRUM_WORDS = (
    "Optical properties and other free parameters against the wavelength, with standard errors where they "
    "hold, and the misfit at each wavelength."
)
_SCANS = {
    "cuts": "Measured and fitted BSDF in the plane of incidence",
    "residual_map": "Residuals over all viewing directions",
    "residual_shape": "The relative residual, and the part of it that smooth modes carry",
}
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
            at = f" at {wave:g} nm" if several else ""
            value = _value(d.value, d.standard_error, holds)
            found.append((_short(value, d.optical_property.unit), f"{d.optical_property.words} of {ink}{at}"))
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
    yield html.section("Parameters", parameters.html(), html.bullets(parameter_notes(result)))
    if result.derived:
        yield html.section("Optical properties", _long(derived_table(result)))
    figures = {name: png for name, png in drawn.items() if name not in (OVERVIEW, SPECTRUM)}
    if figures:
        words = wavelength_words(result.data)
        shown = (html.figure(png, _caption(result, name)) for name, png in figures.items())
        yield html.section("Scans", paragraph(words) if words else "", *shown)
    left_out = masked(result.data)
    if left_out is not None:
        yield left_out
    colours = colours_if_any(result.data, result.predicted_per_sr)
    if colours is not None:
        yield colour_section(colours)
    yield html.section("Figures of merit", merit_table(result.merit, result.deviation).html())
    yield html.section("Misfit by scan", _long(scan_table(result)))
    if result.correlation_names:
        yield html.section("Correlations", html.bullets(correlation_lines(result)))
    if result.minima is not None and result.minima.is_told:
        yield html.section("Minima", paragraph(result.minima.sentence), _long(result.minima.table()))
    if result.residual_shape is not None:
        yield html.section("Shape of the residual", paragraph(result.residual_shape.sentence))
    if result.mistakes:
        yield html.section("Mistakes in the input", *_mistakes(result))
    if result.notes:
        yield html.section("Notes", html.bullets(result.notes))
    searches = search_table(result.searches)
    yield html.section("Searches, settings and versions", _long(searches), html.bullets(_settings(result)))


def _long(table: CardTable) -> str:
    """A table below the heading of its section, in parts that fit on a printed page."""
    return html.tables(table.heads, table.rows, table.text_columns)


def _mistakes(result: "FitResult") -> Iterator[str]:
    """Those that the data name, with what to do, and a table of those that were tried and rejected."""
    named, tried = named_lines(result), rejected_table(result.mistakes)
    if named:
        yield html.bullets(named)
    if tried.rows:
        before, is_misfit = result.verdict.reduced_chi_square, result.verdict.is_misfit
        yield paragraph(f"{tried.title}:")
        yield _long(tried)
        yield paragraph(rejection(result.mistakes, before, is_misfit=is_misfit))


def _caption(result: "FitResult", name: str) -> str:
    """What a figure of `jaxink.plots.figures` shows, by its name, such as ``cuts_R_550nm``."""
    kind, side, wave = name.rsplit("_", 2)
    words = f"{_SCANS[kind]}, in {SIDES[side]} at {wave.removesuffix('nm')} nm."
    below = {"cuts": "Below", "residual_map": "Drawn"}
    return f"{words} {below[kind]}: {residual_words(result)}" if kind in below else words


def _settings(result: "FitResult") -> list[str]:
    return [
        compilation_sentence(result),
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

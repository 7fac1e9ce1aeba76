"""Swatches of measured and fitted colours."""

from collections.abc import Iterable
from html import escape

from jaxink.colour.at_points import ColoursAtPoints
from jaxink.colour.cie import display_code
from jaxink.colour.shown import shown_colour
from jaxink.display.html import paragraph
from jaxink.report import html

_SIDE = 46


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

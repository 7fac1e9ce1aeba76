"""The page of a joint fit: verdict, agreement, parameters, and each measurement with its picture."""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from jaxink.display.html import paragraph
from jaxink.files.result_folder import MEASUREMENTS, PAGE_FILE
from jaxink.files.writing import whole_folder
from jaxink.fitting import FitResult, JointResult, ReadingsResult
from jaxink.numerics.digits import rounded, with_uncertainty
from jaxink.numerics.failures import Failure, Failures
from jaxink.plots import FIGURE_FOLDER, overview_words
from jaxink.report import html
from jaxink.report.fit_html import OVERVIEW, fit_page
from jaxink.report.fit_writing import fit_drawings
from jaxink.report.layer_sketch import layer_sketches
from jaxink.report.sections import missing_parts
from jaxink.report.suggestions import NextStep, joint_next_steps

_NUMBERS = 5
# What the columns of the table of measurements mean.
_COLUMNS = (
    "alone: chi-square of the measurement at its own optimum; cost: what the joint fit costs it; held out: "
    "against the prediction from all others, per point. The reduced "
    "chi-square counts, for each measurement, the share of the parameters that its points have taken up."
)


def write_joint_page(
    result: JointResult,
    folder: str | Path,
    formats: Sequence[str] = ("png",),
    failures: Failures | None = None,
) -> list[Path]:
    """Write ``report.html`` of a joint fit, and page and figures of each measurement.

    Parameters
    ----------
    result
        The fit.
    folder
        That of the saved result; the pages of measurements are written to their folders in it.
    formats
        Of the figures, as in `write_fit_page`.
    failures
        Takes note of what fails; None: it is only named on the pages.

    Returns
    -------
    list
        Paths of the files.
    """
    failures = Failures() if failures is None else failures
    folder, files, overviews = Path(folder), list[Path](), dict[str, bytes]()
    for name, one in result.measurements.items():
        if isinstance(one, ReadingsResult):
            continue
        own = Failures()
        drawn, picture = fit_drawings(one, formats, None, own)
        if OVERVIEW in picture:
            overviews[name] = picture[OVERVIEW]
        place = folder / MEASUREMENTS / name
        content = {PAGE_FILE: fit_page(one, picture, missing=own.found, name=name).encode()}
        content |= {f"{FIGURE_FOLDER}/{figure}": data for figure, data in drawn.items()}
        with failures.sparing("the writing of the page of measurement {}", name):
            files += write_files(place, content)
        for failure in own.found:
            failures.note(failure.part, f"{name}: {failure.name}", failure.reason)
    text = joint_page(result, overviews, joint_next_steps(result, folder), failures.found)
    with failures.sparing("the writing of the page", ""):
        files += write_files(folder, {PAGE_FILE: text.encode()})
    return sorted(files)


def joint_page(
    result: JointResult,
    overviews: Mapping[str, bytes],
    todo: Sequence[NextStep] = (),
    missing: Sequence[Failure] = (),
) -> str:
    """The page of a joint fit.

    Parameters
    ----------
    result
        The fit.
    overviews
        Picture of each measurement as PNG, by name; those that are absent are left out.
    todo
        What to do next.
    missing
        What could not be drawn.
    """
    verdict, holds = result.verdict, result.verdict.standard_errors_hold
    samples = {name: one.sample for name, one in result.measurements.items()}
    numbers = []
    if result.reduced_chi_square is not None:
        numbers.append(
            (rounded(result.reduced_chi_square, 4), "reduced chi-square; noise alone gives about 1")
        )
    for p in result.parameters.free[:_NUMBERS]:
        value = (
            with_uncertainty(p.value, p.standard_error) if holds and p.standard_error else rounded(p.value, 4)
        )
        numbers.append((f"{value} {p.unit}".rstrip(), p.name))
    parts = [
        html.verdict(verdict.sentence, verdict.code, not verdict.code.needs_warning),
        missing_parts(missing),
        paragraph(result.agreement.sentence) if result.agreement is not None else "",
        html.beside(layer_sketches(samples), html.numbers(numbers)),
    ]
    sections = [html.section("Measurements", result.measurement_table().html(), paragraph(_COLUMNS))]
    for name, one in result.measurements.items():
        sections.append(_measurement(name, one, overviews))
    details = [html.section("Parameters", result.parameter_table().html())]
    if result.minima is not None and result.minima.is_told:
        words = paragraph(result.minima.sentence)
        details.append(html.section("Minima", result.minima.table().html(), words))
    noise = [f"{name}: {one.noise_sentence}" for name, one in result.measurements.items()]
    details.append(html.section("Noise", html.bullets(noise)))
    if result.notes:
        details.append(html.section("Notes", html.bullets(result.notes)))
    steps = html.commands((step.words, step.command) for step in todo) if todo else ""
    return html.document(
        f"Joint fit: {result.title or ', '.join(result.measurements)}",
        "".join(parts) + steps,
        sections,
        details,
    )


def _measurement(name: str, one: FitResult | ReadingsResult, overviews: Mapping[str, bytes]) -> html.Section:
    """One measurement: its own verdict, its picture and a link to its page."""
    if isinstance(one, ReadingsResult):
        return html.section(f"Measurement {name}", paragraph(one.verdict.sentence), one.table().html())
    link = f'<p><a href="{MEASUREMENTS}/{escape(name)}/{PAGE_FILE}">All figures of {escape(name)}</a></p>\n'
    picture = html.figure(overviews[name], overview_words(one)) if name in overviews else ""
    return html.section(f"Measurement {name}", paragraph(one.verdict.sentence), picture, link)


def write_files(folder: Path, content: Mapping[str, bytes]) -> list[Path]:
    """Replace page and figures of a folder by these, all or none, and return their paths."""
    with whole_folder(folder, owned=(FIGURE_FOLDER, PAGE_FILE)) as part:
        for name, data in content.items():
            (part / name).parent.mkdir(exist_ok=True)
            (part / name).write_bytes(data)
    return [folder / name for name in content]

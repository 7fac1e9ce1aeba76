"""The page of a diagnosis of several measurements: verdict, effects, misfit before and after, parameters."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from jaxink.diagnosis import JointDiagnosis
from jaxink.display.html import paragraph
from jaxink.files.result_folder import CORRECTED, DECLARED, PAGE_FILE
from jaxink.numerics.digits import rounded
from jaxink.numerics.failures import Failure, Failures
from jaxink.report import html
from jaxink.report.joint_page import write_files, write_joint_page
from jaxink.report.layer_sketch import layer_sketches
from jaxink.report.sections import failed_parts, missing_parts
from jaxink.report.suggestions import NextStep, joint_next_steps

_STEPS = (
    "Δχ²: by how much the effect lowers chi-square, all other parameters fitted again. Probability: that "
    "noise lowers it as much for any of the causes that were looked at."
)


def write_joint_diagnosis_page(
    diagnosis: JointDiagnosis,
    folder: str | Path,
    formats: Sequence[str] = ("png",),
    failures: Failures | None = None,
) -> list[Path]:
    """Write ``report.html`` of a joint diagnosis, and the pages of its two joint fits.

    Parameters
    ----------
    diagnosis
        The diagnosis.
    folder
        That of the saved diagnosis; the pages of its fits are written to their folders in it.
    formats
        Of the figures, as in `write_fit_page`.
    failures
        Takes note of what fails; None: it is only named on the pages.

    Returns
    -------
    list
        Paths of the files.
    """
    failures, folder, files = Failures() if failures is None else failures, Path(folder), list[Path]()
    for name, result in ((DECLARED, diagnosis.declared), (CORRECTED, diagnosis.corrected)):
        with failures.sparing("the page of the {} fit", name):
            files += write_joint_page(result, folder / name, formats, failures)
    todo = joint_next_steps(diagnosis.corrected, folder / CORRECTED)
    with failures.sparing("the writing of the page", ""):
        text = joint_diagnosis_page(diagnosis, todo, failures.found)
        files += write_files(folder, {PAGE_FILE: text.encode()})
    return sorted(files)


def joint_diagnosis_page(
    diagnosis: JointDiagnosis, todo: Sequence[NextStep] = (), missing: Sequence[Failure] = ()
) -> str:
    """The page of a joint diagnosis.

    Parameters
    ----------
    diagnosis
        The diagnosis.
    todo
        What to do next.
    missing
        What could not be written.
    """
    corrected = diagnosis.corrected
    top = [
        html.verdict(diagnosis.sentence, diagnosis.code, not diagnosis.structure_remains),
        failed_parts(diagnosis.failures),
        missing_parts(missing),
        layer_sketches({n: one.sample for n, one in corrected.measurements.items()}),
        html.commands((step.words, step.command) for step in todo) if todo else "",
    ]
    sections = []
    if diagnosis.steps:
        heads = ["effect", "where", "Δχ²", "probability", "not distinguished from"]
        rows = [
            [
                step.effect,
                step.where,
                rounded(step.delta_chi_square, 4),
                html.chance(step.probability),
                "; ".join(step.alike) or html.NONE,
            ]
            for step in diagnosis.steps
        ]
        said = html.bullets(step.sentence for step in diagnosis.steps)
        table = html.tables(heads, rows, (0, 1, 4))
        sections.append(html.section("Effects that were found", said, table, paragraph(_STEPS)))
    links = "".join(
        f'<p><a href="{folder}/{PAGE_FILE}">{escape(words)}</a></p>\n'
        for folder, words in _pages_of(diagnosis)
    )
    sections.append(html.section("Measurements", diagnosis.misfit_table().html(), links))
    if corrected.agreement is not None:
        sections.append(html.section("Agreement", paragraph(corrected.agreement.sentence)))
    parameters = [html.section("Parameters", corrected.parameter_table().html())]
    details = []
    if diagnosis.steps:
        declared = diagnosis.declared.parameter_table().html()
        details.append(html.section("Parameters of the declared model", declared))
    if corrected.notes:
        details.append(html.section("Notes", html.bullets(corrected.notes)))
    title = corrected.title or ", ".join(corrected.measurements)
    return html.document(f"Joint diagnosis: {title}", "".join(top), sections + parameters, details)


def _pages_of(diagnosis: JointDiagnosis) -> list[tuple[str, str]]:
    """Folder and description of the pages of the fits."""
    what = "figures, parameters and agreement of the measurements"
    if not diagnosis.steps:
        return [(CORRECTED, f"The model: {what}")]
    return [(CORRECTED, f"The corrected model: {what}"), (DECLARED, "The declared model, likewise")]

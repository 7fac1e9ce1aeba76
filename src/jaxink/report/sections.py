"""The sections of the report, each from the fields of a diagnosis."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from jaxink.ink.comparison import LARGEST_THETA_DEG, TableComparison
from jaxink.numerics.digits import plain, with_uncertainty
from jaxink.plots.ink_table import FROM_INSIDE
from jaxink.plots.scan_views import measurement_name
from jaxink.report.html import NONE, bullets, chance, number, paragraph, section, share, table, verdict
from jaxink.report.ink_table import inside_sentences

if TYPE_CHECKING:
    from jaxink.diagnosis import CandidateRow, Diagnosis, Figures

_SETTINGS = {
    "max_effects": "most effects",
    "max_parameters": "most free parameters",
    "level": "level",
    "n_bootstrap": "null data sets",
    "seed": "seed",
}


def report_title(diagnosis: "Diagnosis") -> str:
    """Title of the page."""
    name = measurement_name(diagnosis.result)
    return f"Diagnosis of the {name[0].lower() + name[1:] if name.startswith('M') else name}"


def top(diagnosis: "Diagnosis") -> str:
    """The verdict, what was measured, and whether the fit ended well."""
    result, found = diagnosis.result, diagnosis.verdict
    data = result.data
    wavelengths = np.unique(data.wavelength_nm[data.used])
    spectrum = f"{wavelengths[0]:g} nm"
    if wavelengths.size > 1:
        spectrum = f"{wavelengths.size} wavelengths from {wavelengths[0]:g} to {wavelengths[-1]:g} nm"
    parts = [verdict(found.sentence, found.code, found.code.is_met)]
    if not result.converged:
        parts.append(paragraph(f"The fit of the declared model {result.outcome.value}.", "verdict"))
    what = f"{int(data.used.sum())} of {len(data)} points in {len(result.scans)} scans, {spectrum}"
    title = f" Sample: {result.sample.title}." if result.sample.title else ""
    parts.append(paragraph(f"{what}.{title} Noise: {result.noise_sentence}"))
    return "".join(parts)


def merit(diagnosis: "Diagnosis") -> str:
    """Errors before and after, of the fit and of points that it did not see."""
    states = {"as declared": diagnosis.before}
    if diagnosis.steps:
        states["with what was added"] = diagnosis.after
    rows = []
    for name, summary in states.items():
        rows.append([name, "fitted", *_merit_cells(summary.fitted)])
        rows.append([name, "held out", *_merit_cells(summary.held_out)])
    heads = [
        "model",
        "points",
        "absolute RMSD of \N{GREEK SMALL LETTER PI} f",
        "relative RMSD",
        "rms of model / measured - 1",
        "chi-square",
        "degrees of freedom",
        "reduced",
        "probability",
    ]
    parts = [table(heads, rows, (0, 1))]
    if not diagnosis.steps:
        parts.append(paragraph("No effect was added: the model after is the model before."))
    parts.append(
        paragraph("Held out: each point by a fit that did not see its scan, or its part of the scan.")
    )
    return section("Error before and after", *parts)


def _merit_cells(figures: "Figures") -> list[str]:
    return [
        number(figures.rmsd_absolute),
        share(figures.rmsd_relative),
        share(figures.relative_rms),
        number(figures.chi_square, 6),
        str(figures.degrees_of_freedom),
        number(figures.reduced_chi_square),
        chance(figures.probability),
    ]


def steps(diagnosis: "Diagnosis") -> str:
    """The effects that were added, one after the other."""
    if not diagnosis.steps:
        return ""
    rows = []
    for i, s in enumerate(diagnosis.steps):
        gain = with_uncertainty(s.held_out_gain.mean, s.held_out_gain.standard_error)
        others = ", ".join(s.members[1:]) or NONE
        terms = ", ".join(f"{name} = {plain(value)}" for name, value in s.terms.items())
        strength = _with_unit(with_uncertainty(s.strength, s.standard_error), s.unit)
        rows.append(
            [str(i + 1), s.effect, s.form.statement, strength, terms, others]
            + [number(s.predicted_delta_chi_square), number(s.actual_delta_chi_square), gain]
        )
    heads = [
        "step",
        "effect",
        "what it says",
        "strength",
        "all its terms",
        "not told apart from",
        "chi-square falls, predicted",
        "by the refit",
        "gain of held-out log density",
    ]
    return section(
        "What was added",
        table(heads, rows, (1, 2, 4, 5)),
        paragraph(
            "Strength: distance from the declared model, with its standard error in the last digits; none "
            "where the end of a range holds it. The gain is the mean over the fits "
            "that left a part out, with its standard error."
        ),
    )


def parameters(diagnosis: "Diagnosis") -> str:
    """Free parameters before and after."""
    before, after = diagnosis.parameters_before, diagnosis.parameters_after
    misfit_heads = ["misfit may shift by", "determined"] if diagnosis.structure_remains else []
    if not diagnosis.steps:
        rows = [
            [
                name,
                _with_unit(with_uncertainty(*estimate), _unit(diagnosis, name)),
                *_by_misfit(diagnosis, name),
            ]
            for name, estimate in before.items()
        ]
        return section("Parameters", table(["parameter", "value(s.e.)", *misfit_heads], rows))
    rows = []
    for name, (value, error) in after.items():
        unit = _unit(diagnosis, name)
        cells = [NONE, with_uncertainty(value, error), NONE, NONE]
        if name in before:
            first = before[name].value
            cells[0] = with_uncertainty(*before[name])
            cells[2] = share(first / value - 1) if value else NONE
            cells[3] = number((first - value) / error, 3) if error else NONE
        rows.append([name, unit, *cells, *_by_misfit(diagnosis, name)])
    heads = ["parameter", "unit", "before(s.e.)", "after(s.e.)", "bias of before", "in standard errors"]
    heads += misfit_heads
    text = "The bias is before minus after, relative to the value after, and in standard errors of it."
    if misfit_heads:
        text += (
            " What remains of the misfit may have shifted the value after by the last but one column (a "
            "standard deviation); a value that it may have shifted to the end of its range is not determined."
        )
    return section("Parameters before and after", table(heads, rows, (0, 1)), paragraph(text))


def _by_misfit(diagnosis: "Diagnosis", name: str) -> list[str]:
    if not diagnosis.structure_remains:
        return []
    return [number(diagnosis.misfit_errors[name], 3), "no" if name in diagnosis.undetermined else "yes"]


def _unit(diagnosis: "Diagnosis", name: str) -> str:
    tables = (diagnosis.refined.parameters, diagnosis.result.sample.parameters)
    return next((t[name].unit for t in tables if name in t), "")


def _with_unit(text: str, unit: str) -> str:
    return f"{text} {unit}" if unit else text


def candidates(diagnosis: "Diagnosis", *figures: str) -> str:
    """All effects that were looked for, and those that cannot be."""
    heads = [
        "effect",
        "z",
        "p",
        "p of all together",
        "absorbed by parameters",
        "detection limit",
        "unit of the limit",
        "strength",
        "unit",
        "class",
        "chi-square falls, predicted",
        "by a refit",
        "status",
        "reason",
    ]
    rows = [_candidate_cells(row) for row in diagnosis.candidates]
    parts = [table(heads, rows, (0, 6, 8, 9, 12, 13))]
    parts.append(
        paragraph(
            "p of all together: chance that any effect stands out as much where there is noise alone. "
            "Absorbed: share of the effect that the free parameters imitate. Strength: by the refit where "
            "there was one, else by the screen. A share: of the area, like a typical case of the effect."
        )
    )
    if diagnosis.not_testable:
        lines = (f"{name}: {reason}" for name, reason in diagnosis.not_testable.items())
        parts += [paragraph("These data say nothing about:"), bullets(lines)]
    return section("Effects that were looked for", *parts, *figures)


def _candidate_cells(row: "CandidateRow") -> list[str]:
    return [
        row.effect,
        number(row.z, 3),
        chance(row.p_raw),
        chance(row.p_adjusted),
        share(row.degenerate_fraction),
        number(row.detection_limit, 3),
        row.detection_limit_unit,
        number(row.strength),
        row.unit,
        ", ".join(row.members) if len(row.members) > 1 else "",
        number(row.predicted_delta_chi_square),
        number(row.refit_delta_chi_square),
        row.status.replace("_", " "),
        row.reason,
    ]


def remains(diagnosis: "Diagnosis") -> str:
    """What stands in the residual after the last step."""
    location = diagnosis.location
    sentence = location.sentence[0].upper() + location.sentence[1:]
    smooth = f"{share(location.smooth.share)} of its mean square is smooth"
    parts = [paragraph(f"{sentence}. {smooth} (p = {chance(location.smooth.p_value)}).")]
    states = {"as declared": diagnosis.structure_before}
    if diagnosis.steps:
        states["with what was added"] = diagnosis.structure_after
    heads, rows = ["test of order"], dict[str, list[str]]()
    for name, structure in states.items():
        heads += [f"value {name}", "p", "p of the worst scan"]
        for s in structure.statistics:
            cells = [number(s.value), chance(s.p_value), chance(s.worst_p_value)]
            rows.setdefault(s.name, [s.name.replace("_", " ")]).extend(cells)
    parts.append(table(heads, rows.values()))
    lines = []
    for name, structure in states.items():
        led = f", led by {structure.leading.replace('_', ' ')}" if structure.leading else ""
        lines.append(f"All tests together, {name}: p = {chance(structure.p_value)}{led}.")
    parts.append(bullets(lines))
    if diagnosis.consistency:
        parts.append(paragraph("Readings that must be equal, under the noise in use:"))
        heads = ["readings", "pairs", "deviation of one reading", "noise of one reading", "p"]
        pairs = (
            [c.kind, str(c.pairs), share(c.relative), share(c.expected), chance(c.p_value)]
            for c in diagnosis.consistency
        )
        parts.append(table(heads, pairs))
    if location.factors:
        parts.append(paragraph("Where it stands, in standard deviations of the noise:"))
        heads = ["divided by", "share of the smooth part", "p", "mean residuals"]
        factors = (
            [f.name, share(f.share), chance(f.p_value), _levels(f.levels, f.means)] for f in location.factors
        )
        parts.append(table(heads, factors, (0, 3)))
    return section("What remains", *parts)


def _levels(levels: Sequence[str], means: np.ndarray) -> str:
    known = [(level, mean) for level, mean in zip(levels, means, strict=True) if np.isfinite(mean)]
    return "; ".join(f"{level} {mean:+.2f}" for level, mean in known)


def inside(diagnosis: "Diagnosis", change: TableComparison | str, *figures: str) -> str:
    """What was found changes in the BSDF that is exported."""
    title = "The ink for light inside the plate"
    if isinstance(change, str):
        return section(title, paragraph(change))
    rows = []
    for i in range(len(change.before.wavelength_nm)):
        for component, words in FROM_INSIDE.items():
            c = change.of(component, i)
            where = f"{c.theta_i_deg:.0f}° to {c.theta_o_deg:.0f}°, azimuth {c.phi_deg:.0f}°"
            rows.append(
                [f"{component}, {words}", f"{c.wavelength_nm:g} nm", f"{number(c.rms_percent, 3)} %"]
                + [f"{c.largest_percent:+.3g} %", where]
            )
    heads = ["component", "wavelength", "rms change", "largest", "there"]
    text = (
        "Change of the BSDF from the fit of the declared model to that with what was added, over all "
        f"directions to {LARGEST_THETA_DEG:g}° from the normal on either side."
    )
    lines = inside_sentences(diagnosis)
    return section(title, paragraph(text), table(heads, rows, (0, 4)), bullets(lines), *figures)


def origin(diagnosis: "Diagnosis") -> str:
    """What is needed to repeat it."""
    result = diagnosis.result
    lines = [f"Catalogue of effects: version {diagnosis.to_dict()['catalogue_version']}."]
    chosen = {name: diagnosis.settings[key] for key, name in _SETTINGS.items()}
    said = ", ".join(f"{name} {value:g}" for name, value in chosen.items() if value is not None)
    lines.append(f"Diagnosis: {said}.")
    lines.append(f"Fit of the declared model: {result.method}, {result.outcome.value}; seed {result.seed}.")
    lines.append(f"Discretisation: {', '.join(f'{k} {v}' for k, v in result.solver.items())}.")
    lines.append(f"Versions: {', '.join(f'{k} {v}' for k, v in result.versions.items())}.")
    return section("How it was computed", bullets(lines))

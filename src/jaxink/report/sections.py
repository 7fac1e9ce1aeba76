"""Sections of the report."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from jaxink.diagnosis import TESTS
from jaxink.display.html import paragraph, table
from jaxink.effects import Inapplicable
from jaxink.fitting import points_words
from jaxink.ink import LARGEST_THETA_DEG, TableComparison
from jaxink.measurement import mask_sentences
from jaxink.numerics.digits import plain, with_uncertainty
from jaxink.numerics.failures import Failure
from jaxink.plots import FROM_INSIDE, is_simulated, measurement_name
from jaxink.report.hidden import HiddenChange
from jaxink.report.html import (
    NONE,
    Section,
    bullets,
    chance,
    number,
    section,
    share,
    tables,
    verdict,
)
from jaxink.report.ink_table import inside_sentences

if TYPE_CHECKING:
    from jaxink.diagnosis import CandidateRow, Diagnosis, Figures
    from jaxink.fitting import Deviation, FitResult
    from jaxink.measurement import GonioData

T = TypeVar("T")
_UNCONSTRAINED = "The data do not constrain these effects:"
_INAPPLICABLE = "These effects do not apply to the sample as it is declared:"
# The analysis of variance calls it by what it may mean.
_FACTORS = {"time": "order of rows"}
_SETTINGS = {
    "max_effects": "maximum number of effects",
    "max_parameters": "maximum number of free parameters",
    "level": "significance level",
    "n_bootstrap": "null data sets",
    "seed": "seed",
}


def report_title(diagnosis: "Diagnosis") -> str:
    """Title of the page."""
    return f"Diagnosis: {measurement_name(diagnosis.declared)}"


def top(diagnosis: "Diagnosis", missing: Sequence[Failure] = ()) -> str:
    """The verdict, the measurement, whether the fit converged, and what is missing here."""
    result, found = diagnosis.declared, diagnosis.verdict
    parts = [verdict(found.sentence, found.code, found.code.fits_noise)]
    if not result.converged:
        parts.append(paragraph(f"The fit of the declared model {result.outcome.value}.", "verdict"))
    limit = diagnosis.time_limit
    if limit is not None and limit.not_done:
        parts.append(paragraph(f"Not done within the time limit of {limit.limit_s:g} s:"))
        parts.append(bullets(omission.described() for omission in limit.not_done))
    parts += [failed_parts(diagnosis.failures), missing_parts(missing), paragraph(measured_words(result))]
    return "".join(parts)


def failed_parts(failures: Sequence[Failure]) -> str:
    """Parts of a diagnosis that failed; nothing if none did."""
    if not failures:
        return ""
    words = paragraph("Parts of the diagnosis failed and are missing:")
    return words + bullets(failure.sentence for failure in failures)


def missing_parts(missing: Sequence[Failure]) -> str:
    """What could not be drawn or tabulated; nothing if all could."""
    if not missing:
        return ""
    words = paragraph("Parts of this page failed and are missing; the results are complete:")
    return words + bullets(failure.sentence for failure in missing)


def measured_words(result: "FitResult") -> str:
    """What was measured and used, and its noise."""
    simulated = " The measurement is SIMULATED." if is_simulated(result) else ""
    return f"{points_words(result.data)}.{simulated} Noise: {result.noise_sentence}"


def merit(diagnosis: "Diagnosis") -> Section:
    """Errors of the declared and the corrected model, for fitted and held-out points."""
    rows = []
    for name, summary in _states(diagnosis, diagnosis.before, diagnosis.after):
        for points, figures, deviation in summary.rows(diagnosis.measured_per_sr):
            rows.append([name, points, *_merit_cells(figures, deviation)])
    heads = [
        "model",
        "points",
        "absolute RMSD of \N{GREEK SMALL LETTER PI} f",
        "relative RMSD",
        "rms of measured / model - 1",
        "χ²",
        "degrees of freedom",
        "reduced χ²",
        "p",
    ]
    parts = [table(heads, rows, (0, 1))]
    if not diagnosis.steps:
        parts.append(paragraph("No effect was added."))
    text = "Held out: each point is predicted by a fit without its scan, or without its part of the scan."
    return section("Error of each model", *parts, paragraph(text))


def _states(diagnosis: "Diagnosis", before: T, after: T) -> list[tuple[str, T]]:
    """Values of the declared and, if effects were added, of the corrected model, with their names."""
    return [("declared", before), ("corrected", after)][: 2 if diagnosis.steps else 1]


def _merit_cells(figures: "Figures", deviation: "Deviation | None") -> list[str]:
    return [
        number(figures.rmsd_absolute),
        share(figures.rmsd_relative),
        share(deviation and deviation.rms),
        number(figures.chi_square, 6),
        str(figures.degrees_of_freedom),
        number(figures.reduced_chi_square),
        chance(figures.probability),
    ]


def added(diagnosis: "Diagnosis") -> Section | None:
    """The effects that were added, each in a sentence with its numbers."""
    if not diagnosis.steps:
        return None
    lines = []
    for s in diagnosis.steps:
        others = (
            f" These data cannot distinguish it from {', '.join(s.members[1:])}." if s.members[1:] else ""
        )
        why = diagnosis.imitations.get(s.effect)
        doubt = f" It may imitate another cause: {why}." if why else ""
        fall = f"Chi-square decreases by {s.actual_delta_chi_square:.0f}."
        lines.append(f"{s.sentence[0].upper()}{s.sentence[1:]} ({s.effect}). {fall}{others}{doubt}")
    return section("What was missing", bullets(lines))


def steps(diagnosis: "Diagnosis") -> Section | None:
    """The effects that were added, in this order."""
    if not diagnosis.steps:
        return None
    rows = []
    for i, s in enumerate(diagnosis.steps):
        gain = with_uncertainty(s.held_out_gain.mean, s.held_out_gain.standard_error)
        others = ", ".join(s.members[1:]) or NONE
        terms = ", ".join(f"{name} = {plain(value)}" for name, value in s.terms.items())
        strength = _with_unit(with_uncertainty(s.shown, s.standard_error), s.unit)
        rows.append(
            [str(i + 1), s.effect, s.form.statement, strength, terms, others]
            + [number(s.predicted_delta_chi_square), number(s.actual_delta_chi_square), gain]
        )
    heads = [
        "step",
        "effect",
        "meaning",
        "strength",
        "all parameters",
        "indistinguishable from",
        "Δχ² predicted",
        "Δχ² by refit",
        "gain in held-out log density",
    ]
    text = (
        "Strength: distance from the declared model, with its standard error in units of the last digits "
        "(none at the end of a range). Gain: mean over the fits with parts held out, with its standard error."
    )
    return section("Effects added, step by step", table(heads, rows, (1, 2, 4, 5)), paragraph(text))


def parameters(diagnosis: "Diagnosis") -> Section:
    """Free parameters of the declared and the corrected model."""
    before, after = diagnosis.parameters_before, diagnosis.parameters_after
    misfit_heads = ["possible shift by misfit", "determined"] if diagnosis.structure_remains else []
    if not diagnosis.steps:
        values = {n: _with_unit(with_uncertainty(*e), _unit(diagnosis, n)) for n, e in before.items()}
        rows = [[name, value, *_by_misfit(diagnosis, name)] for name, value in values.items()]
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
    heads = ["parameter", "unit", "declared(s.e.)", "corrected(s.e.)", "declared / corrected - 1"]
    heads += ["difference / s.e.", *misfit_heads]
    text = "Difference: declared minus corrected, in units of the corrected standard error (s.e.)."
    if misfit_heads:
        text += (
            " The remaining misfit may have shifted the corrected value by the amount in the last but one "
            "column (one standard deviation). A value that may have been shifted to the end of its range is "
            "not determined."
        )
        held = [p.name for p in diagnosis.corrected.parameters.free if p.flag.startswith("at ")]
        if held:
            text += f" All others are those at the bound of {', '.join(held)}, and change if it does."
    return section("Parameters of each model", table(heads, rows, (0, 1)), paragraph(text))


def _by_misfit(diagnosis: "Diagnosis", name: str) -> list[str]:
    if not diagnosis.structure_remains:
        return []
    return [number(diagnosis.misfit_errors[name], 3), "no" if name in diagnosis.undetermined else "yes"]


def _unit(diagnosis: "Diagnosis", name: str) -> str:
    tables = (diagnosis.corrected.sample.parameters, diagnosis.declared.sample.parameters)
    return next((t[name].unit for t in tables if name in t), "")


def _with_unit(text: str, unit: str) -> str:
    return f"{text} {unit}" if unit else text


def candidates(diagnosis: "Diagnosis", *figures: str) -> Section:
    """All effects that were tested, and those that cannot be."""
    found = [
        "effect",
        "status",
        "z",
        "p",
        "family-wise adjusted p",
        "Δχ² predicted",
        "Δχ² by refit",
        "strength",
        "unit",
    ]
    limits = [
        "effect",
        "detection limit",
        "unit of the limit",
        "degenerate with parameters",
        "class",
        "reason",
    ]
    words = (
        "Family-wise adjusted p: probability that noise alone makes any effect this significant. Strength: "
        "from the refit if there was one, otherwise from the screen. Unit share: part of the area that is "
        "like a typical case of the effect."
    )
    of_limits = (
        "What the data could show. Degenerate with parameters: fraction of the effect that the free "
        "parameters reproduce. Class: effects that the data cannot distinguish."
    )
    parts = [
        tables(found, map(_found_cells, diagnosis.candidates), (0, 1, 8)),
        paragraph(words),
        tables(limits, map(_limit_cells, diagnosis.candidates), (0, 2, 4, 5)),
        paragraph(of_limits),
    ]
    for head, lines in untested(diagnosis.not_testable).items():
        parts += [paragraph(head), bullets(lines)]
    return section("Effects tested", *parts, *figures)


def untested(reasons: Mapping[str, str]) -> dict[str, list[str]]:
    """Effects without a test, with their reasons, below one heading for those that these data cannot show."""
    found = dict[str, list[str]]()
    for name, reason in reasons.items():
        head = _INAPPLICABLE if isinstance(reason, Inapplicable) else _UNCONSTRAINED
        found.setdefault(head, []).append(f"{name}: {reason}")
    return found


def _found_cells(row: "CandidateRow") -> list[str]:
    return [
        row.effect,
        row.status.replace("_", " "),
        number(row.z, 3),
        chance(row.p_raw),
        chance(row.p_adjusted),
        number(row.predicted_delta_chi_square),
        number(row.refit_delta_chi_square),
        number(row.strength),
        row.unit,
    ]


def _limit_cells(row: "CandidateRow") -> list[str]:
    return [
        row.effect,
        number(row.detection_limit, 3),
        row.detection_limit_unit,
        share(row.degenerate_fraction),
        ", ".join(row.members) if len(row.members) > 1 else "",
        row.reason,
    ]


def remains(diagnosis: "Diagnosis") -> Section:
    """What is left in the residual after the last step, in words."""
    return section("What remains", paragraph(diagnosis.remainder))


def tests(diagnosis: "Diagnosis") -> Section:
    """Tests for structure in the residual, and where it is large."""
    location, parts = diagnosis.location, list[str]()
    states = _states(diagnosis, diagnosis.structure_before, diagnosis.structure_after)
    heads, rows = ["test for structure"], dict[str, list[str]]()
    for name, structure in states:
        heads += [f"value, {name} model", "p", "p of the worst scan"]
        for s in structure.statistics:
            cells = [number(s.value), chance(s.p_value), chance(s.worst_p_value)]
            rows.setdefault(s.name, [TESTS[s.name]]).extend(cells)
    parts.append(table(heads, [*rows.values(), *_smooth_tests(diagnosis, len(states))]))
    lines = []
    for name, structure in states:
        led = f"; most significant: {TESTS[structure.leading]}" if structure.leading else ""
        lines.append(f"All tests combined, {name} model: p = {chance(structure.p_value)}{led}.")
    parts.append(bullets(lines))
    if diagnosis.consistency:
        parts.append(paragraph("Readings that must agree within the noise:"))
        heads = ["readings", "pairs", "scatter of a reading", "noise of a reading", "p"]
        pairs = (
            [c.kind, str(c.pairs), share(c.relative), share(c.expected), chance(c.p_value)]
            for c in diagnosis.consistency
        )
        parts.append(table(heads, pairs))
    if location.factors:
        parts.append(paragraph("Mean residuals by group, in standard deviations of the noise:"))
        heads = ["grouped by", "share of the smooth part", "p", "mean residuals"]
        factors = (
            [_FACTORS.get(f.name, f.name), share(f.share), chance(f.p_value), _levels(f.levels, f.means)]
            for f in location.factors
        )
        parts.append(table(heads, factors, (0, 3)))
    return section("Tests of the remaining residual", *parts)


def _smooth_tests(diagnosis: "Diagnosis", n_states: int) -> list[list[str]]:
    """Tests for a smooth part; made of the last model only."""
    before = [NONE] * 3 * (n_states - 1)
    smooth, shape = diagnosis.location.smooth, diagnosis.shape
    rows = [["smooth part of any scale (Gaussian process)", *before, NONE, chance(smooth.p_value), NONE]]
    if shape is not None:
        rows.append([TESTS["modes"], *before, NONE, chance(shape.p_value), NONE])
    return rows


def _levels(levels: Sequence[str], means: np.ndarray) -> str:
    known = [(level, mean) for level, mean in zip(levels, means, strict=True) if np.isfinite(mean)]
    return "; ".join(f"{level} {mean:+.2f}" for level, mean in known)


def inside(diagnosis: "Diagnosis", change: TableComparison | str, *figures: str) -> Section:
    """Change of the exported BSDF."""
    title = "BSDF of the ink inside the plate"
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
    heads = ["component", "wavelength", "rms change", "largest change", "directions"]
    text = (
        "Change of the BSDF from the declared to the corrected model, over all directions up to "
        f"{LARGEST_THETA_DEG:g}° from the normal on either side."
    )
    parts = paragraph(text), table(heads, rows, (0, 4)), bullets(inside_sentences(diagnosis))
    return section(title, *parts, *figures)


def hidden(changes: list[HiddenChange] | str) -> Section | None:
    """What effects too weak to be seen would change."""
    title = "What could still hide"
    if isinstance(changes, str):
        return section(title, paragraph(changes))
    if not changes:
        return None
    rows = []
    for change in changes:
        effect = change.hidden
        strength = f"{number(effect.strength, 3)} {effect.unit}".strip()
        shift = f"{effect.largest_in_errors:.1f}"
        rows.append([effect.effect, strength, shift, f"{number(change.percent, 2)} %"])
    heads = [
        "unseen effect",
        "strength",
        "largest shift of a parameter, standard errors",
        "change of R_II, rms",
    ]
    text = (
        "None of these was found. Each may be present up to its detection limit, or its usual strength if "
        "that is less: the parameters would then be fitted with a shift that the data do not show, and with "
        "them the BSDF back into the plate. These limits are linear ones, of the model with what was found; "
        "those in the table of the effects tested are verified by refits if none was found."
    )
    return section(title, paragraph(text), table(heads, rows, (0,)))


def masked(data: "GonioData") -> Section | None:
    """Points that were left out, with the reasons."""
    mask = data.mask
    return section("Masked points", bullets(mask_sentences(mask))) if mask.any() else None


def origin(diagnosis: "Diagnosis") -> Section:
    """Settings and versions, for a repetition."""
    result = diagnosis.declared
    lines = [f"Catalogue of effects: version {diagnosis.to_dict()['catalogue_version']}."]
    chosen = {name: diagnosis.settings[key] for key, name in _SETTINGS.items()}
    said = ", ".join(f"{name} {value:g}" for name, value in chosen.items() if value is not None)
    lines.append(f"Diagnosis: {said}.")
    lines.append(f"Fit of the declared model: {result.method}, {result.outcome.value}; seed {result.seed}.")
    lines.append(f"Resolution: {', '.join(f'{k} {v}' for k, v in result.solver.items())}.")
    lines.append(f"Versions: {', '.join(f'{k} {v}' for k, v in result.versions.items())}.")
    return section("Settings and versions", bullets(lines))

"""The sample file of a corrected model, with comments that say what was added and why."""

from jaxink.diagnosis.findings.verdict import Verdict
from jaxink.diagnosis.search.step import Step
from jaxink.files.result_folder import DIAGNOSIS_HEAD
from jaxink.files.version import installed_version
from jaxink.fitting import FitResult
from jaxink.numerics.digits import with_uncertainty
from jaxink.sample import sample_text


def corrected_text(corrected: FitResult, verdict: Verdict, steps: tuple[Step, ...]) -> str:
    """Text of the sample file of the corrected model of a diagnosis."""
    head = [
        f"{DIAGNOSIS_HEAD} {corrected.data.source or 'a measurement'} by jaxink {installed_version()}.",
        verdict.sentence,
        "The declared sample with the effects that were found. Values are those of the fit; what was free is",
        "still free.",
        "",
    ]
    return sample_text(corrected.sample, _remarks(corrected, steps), head)


def _remarks(corrected: FitResult, steps: tuple[Step, ...]) -> dict[str, str]:
    """A comment for each effect that was added, by its table or by its first parameter."""
    declared = {effect.name for effect in corrected.sample.effects}
    remarks = {}
    for step in steps:
        place = f"effects.{step.effect}" if step.effect in declared else step.form.strength.name
        rows = [corrected[name] for name in step.terms if name in corrected.parameters]
        found = ", ".join(
            f"{p.name} = {with_uncertainty(p.value, p.standard_error)} {p.unit}".rstrip() for p in rows
        )
        lines = [
            f"Added by the diagnosis: {step.form.statement}.",
            f"Chi-square decreased by {step.actual_delta_chi_square:.1f}; {found}.",
        ]
        if others := [name for name in step.members if name != step.effect]:
            lines.append(f"These data cannot distinguish it from: {', '.join(others)}.")
        remarks[place] = "\n".join(lines)
    return remarks

"""The diagnosis of several measurements."""

import dataclasses
from typing import Any, ClassVar

from jaxink.diagnosis.findings.verdict import VerdictCode
from jaxink.display.brief import brief_repr, counted
from jaxink.display.card import Card, CardTable, Presented
from jaxink.files.encoding import SavedInFolder, plain
from jaxink.files.result_folder import CORRECTED, DECLARED, JOINT_REPORT
from jaxink.fitting import FitVerdictCode, JointResult
from jaxink.numerics.digits import rounded
from jaxink.numerics.failures import Failure

SCHEMA_VERSION = 1


@dataclasses.dataclass(frozen=True)
class JointStep:
    """An effect that was found.

    Parameters
    ----------
    effect
        Its name.
    statement
        What is true of the sample or the instrument, with numbers.
    where
        In which measurements, in words.
    measurements
        Their names.
    parameters
        Names in the project of its parameters.
    chi_square_before
        Of all measurements and priors, without it.
    delta_chi_square
        By how much it lowers this, with all other parameters fitted again.
    probability
        That noise lowers it as much for any of the causes that were looked at.
    alike
        Causes that the data do not distinguish from it.
    """

    __repr__ = brief_repr

    effect: str
    statement: str
    where: str
    measurements: tuple[str, ...]
    parameters: tuple[str, ...]
    chi_square_before: float
    delta_chi_square: float
    probability: float
    alike: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """For the user."""
        words = (
            f"{self.statement[0].upper()}{self.statement[1:]}, {self.where} ({self.effect}; lowers "
            f"chi-square from {rounded(self.chi_square_before, 5)} by {rounded(self.delta_chi_square, 4)})."
        )
        if self.alike:
            words += f" The data do not distinguish it from: {'; '.join(self.alike)}."
        return words


@dataclasses.dataclass(frozen=True, repr=False)
class JointDiagnosis(SavedInFolder, Presented):
    """What the model of several measurements lacks.

    Parameters
    ----------
    declared, corrected
        Joint fits of the declared model, and of that with the effects found; the same if there is none.
    steps
        The effects found, in order.
    n_candidates
        Number of causes that were looked at.
    failures
        Parts that failed.
    """

    json_file: ClassVar[str] = JOINT_REPORT
    owned: ClassVar[tuple[str, ...]] = (DECLARED, CORRECTED)

    declared: JointResult
    corrected: JointResult
    steps: tuple[JointStep, ...]
    n_candidates: int
    failures: tuple[Failure, ...]

    @property
    def structure_remains(self) -> bool:
        """Whether the corrected model is a misfit, or its measurements disagree."""
        disagree = self.corrected.agreement is not None and self.corrected.agreement.disagrees
        return self.corrected.verdict.is_misfit or disagree

    @property
    def is_untested(self) -> bool:
        """Whether nothing could be tested, as there are not more points than free parameters."""
        return self.declared.verdict.code is FitVerdictCode.NOT_JUDGED and not self.n_candidates

    @property
    def code(self) -> VerdictCode:
        """The verdict as one word."""
        if self.is_untested:
            return VerdictCode.NOT_TESTABLE
        if self.steps:
            return VerdictCode.PARTLY_EXPLAINED if self.structure_remains else VerdictCode.EXPLAINED
        return VerdictCode.UNEXPLAINED_STRUCTURE if self.structure_remains else VerdictCode.NO_MISFIT

    @property
    def sentence(self) -> str:
        """The verdict as a sentence."""
        if self.is_untested:
            return f"{self.declared.verdict.sentence} No cause was looked for."
        looked = f"none of {counted(self.n_candidates, 'cause')} that were looked at"
        if not self.steps:
            if not self.n_candidates:
                looked = "no cause was looked for"
            else:
                looked += " explains it" if self.structure_remains else " is called for"
            if self.structure_remains:
                return f"The model does not fit all measurements; {looked}."
            return f"The model fits all measurements as it is; {looked}."
        names = ", ".join(f"{step.effect} {step.where}" for step in self.steps)
        return f"{'Partly explained' if self.structure_remains else 'Explained'} by {names}."

    def card(self) -> Card:
        """The verdict, the effects, and the misfit before and after."""
        sentences = [self.sentence, *(step.sentence for step in self.steps)]
        tables: list[CardTable] = [self.misfit_table(), self.corrected.parameter_table()]
        remarks = [*self.corrected.notes, *(failure.sentence for failure in self.failures)]
        title = f"Diagnosis of {counted(len(self.declared.measurements), 'measurement')}"
        return Card(title, sentences, tables, remarks)

    def misfit_table(self) -> CardTable:
        """Chi-square of each measurement in both joint fits, or in the one that there is."""
        rows = []
        for name, before in self.declared.measurements.items():
            after = self.corrected.measurements[name].merit.chi_square
            both = rounded(before.merit.chi_square, 5), rounded(after, 5)
            rows.append([name, str(before.merit.points), *both[: self._n_models]])
        reduced = [
            "" if one.reduced_chi_square is None else rounded(one.reduced_chi_square, 4)
            for one in (self.declared, self.corrected)
        ]
        rows.append(["all, reduced", str(self.declared.points), *reduced[: self._n_models]])
        heads = ["chi-square as declared", "with the effects"] if self.steps else ["chi-square"]
        return CardTable(["measurement", "points", *heads], rows)

    @property
    def _n_models(self) -> int:
        return 2 if self.steps else 1

    def to_dict(self) -> dict[str, Any]:
        """Plain data, as in ``joint_report.json``."""
        return {
            "schema_version": SCHEMA_VERSION,
            "code": self.code.value,
            "verdict": self.sentence,
            "structure_remains": self.structure_remains,
            "causes_looked_at": self.n_candidates,
            "steps": plain(self.steps),
            "declared": self.declared.result_id,
            "corrected": self.corrected.result_id,
            "failures": [failure.sentence for failure in self.failures],
        }

    def files_beside(self) -> dict[str, bytes]:
        """Both joint fits, in the folders ``declared`` and ``corrected``."""
        return {
            f"{name}/{file}": content
            for name, result in ((DECLARED, self.declared), (CORRECTED, self.corrected))
            for file, content in result.files().items()
        }

"""An effect in some of the measurements of a project."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

from jaxink.display.brief import brief_repr
from jaxink.effects import Effect, declare
from jaxink.projects import Measurement, Project
from jaxink.projects.project import OF

INSTRUMENT = "instrument"


@dataclasses.dataclass(frozen=True)
class Cause:
    """An effect, and the measurements that have it.

    Parameters
    ----------
    owner
        Measurement or instrument to which its parameters belong; empty if all measurements share them.
    forms
        The effect in each of the measurements that have it.
    """

    __repr__ = brief_repr

    owner: str
    forms: Mapping[str, Effect]

    @property
    def effect(self) -> Effect:
        """Its form in the first of them."""
        return next(iter(self.forms.values()))

    @property
    def where(self) -> str:
        """In words, after the name of the effect."""
        if not self.owner:
            return "in all measurements"
        if set(self.forms) == {self.owner}:
            return f"in '{self.owner}' alone"
        measured = ", ".join(self.forms)
        return f"of '{self.owner}': in {measured}"

    def named(self, parameter: str) -> str:
        """Name in the project of a parameter of the effect."""
        return f"{self.owner}{OF}{parameter}" if self.owner else parameter

    def added(self, project: Project, values: Mapping[str, float]) -> Project:
        """The project with the effect, its parameters free; their values by their names in a sample."""
        changed = (self._with_effect(one, values) for one in project.measurements)
        return dataclasses.replace(project, measurements=tuple(changed))

    def _with_effect(self, one: Measurement, values: Mapping[str, float]) -> Measurement:
        if one.name not in self.forms:
            return one
        sample, before = declare(one.sample, (self.forms[one.name],), values), one.sample.parameters
        names = dict(one.names)
        for name, parameter in sample.parameters.items():
            if name not in before or (parameter.free and not before[name].free):
                names[name] = self.named(name)
        return dataclasses.replace(one, sample=sample, names=names)


def owners(project: Project, names: Sequence[str], effect: Effect) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Who may own an effect that some measurements can have, and which of them then have it.

    What belongs to the sample is in all of them, what belongs to an instrument in all that it measured;
    either may be in one measurement alone.

    Parameters
    ----------
    project
        The measurements.
    names
        Those in which the effect can be.
    effect
        The effect.
    """
    of_instruments: dict[str, list[str]] = {}
    for one in project.measurements:
        if one.name in names:
            of_instruments.setdefault(one.instrument, []).append(one.name)
    if effect.group != INSTRUMENT or set(of_instruments) == {""}:
        if len(names) > 1:
            yield "", tuple(names)
    else:
        for instrument, measured in of_instruments.items():
            if instrument and len(measured) > 1:
                yield instrument, tuple(measured)
    for name in names:
        yield name, (name,)

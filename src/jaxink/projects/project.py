"""Several measurements of one ink, and which of their parameters they have in common."""

import dataclasses
import re
from collections import Counter
from collections.abc import Mapping
from functools import cached_property

from jaxink.display.brief import counted
from jaxink.display.card import Card, CardTable, Presented
from jaxink.errors import InputRefusedError, require_kind
from jaxink.measurement import GonioData, Readings
from jaxink.sample import Parameter, Sample

# Separates the measurement or instrument that a parameter belongs to from the name of the parameter.
OF = "/"
_NAME = re.compile(r"[A-Za-z0-9_-]{1,60}")


@dataclasses.dataclass(frozen=True, repr=False)
class Measurement(Presented):
    """One measurement of a project, with the sample as it was then.

    Parameters
    ----------
    name
        Of letters, digits, hyphens and underscores; names its folder among the results.
    data
        What was measured: a BSDF, or readings of other instruments.
    sample
        The sample as this measurement saw it: layers in the order in which light meets them, with what was
        behind it and the properties of the instrument.
    names
        Name in the project of each parameter of the sample. Measurements that use the same name share the
        parameter.
    instrument
        Name of the instrument, or empty.
    """

    name: str
    data: GonioData | Readings
    sample: Sample
    names: Mapping[str, str]
    instrument: str = ""

    def __post_init__(self):
        require_kind("name of a measurement", self.name, str)
        if not _NAME.fullmatch(self.name):
            raise InputRefusedError(
                f"measurement {self.name!r}: a name consists of up to 60 letters, digits, hyphens and "
                "underscores, as it is that of a folder."
            )
        require_kind(f"data of the measurement '{self.name}'", self.data, GonioData, Readings)
        require_kind(f"sample of the measurement '{self.name}'", self.sample, Sample)
        if missing := [name for name in self.sample.parameters if name not in self.names]:
            raise InputRefusedError(
                f"measurement '{self.name}' does not say what {missing[0]} is named in the project."
            )

    @property
    def n_points(self) -> int:
        """Number of points that a fit uses."""
        return len(self.data) if isinstance(self.data, Readings) else int(self.data.used.sum())

    @property
    def own(self) -> tuple[str, ...]:
        """Names in the project of the parameters that belong to this measurement alone."""
        return tuple(name for name in self.names.values() if name.startswith(self.name + OF))

    def card(self) -> Card:
        """The measurement and its sample."""
        return Card(
            f"Measurement '{self.name}'", (*self.data.card().sentences, *self.sample.card().sentences)
        )


@dataclasses.dataclass(frozen=True, repr=False)
class Project(Presented):
    """Measurements that share a sample, for a joint fit.

    Parameters
    ----------
    measurements
        One or more; their names differ.
    title
        For people.

    Raises
    ------
    InputRefusedError
        There is no measurement, two have one name, or a shared parameter is not the same in two samples.
    """

    measurements: tuple[Measurement, ...]
    title: str = ""

    def __post_init__(self):
        if not self.measurements:
            raise InputRefusedError("the project has no measurement; give at least one.")
        # Folders of some systems do not distinguish capital letters.
        for name, count in Counter(one.name.lower() for one in self.measurements).items():
            if count > 1:
                raise InputRefusedError(f"{count} measurements are named '{name}'; names must differ.")
        known: dict[str, tuple[Parameter, str]] = {}
        for one in self.measurements:
            for parameter in one.sample.parameters.values():
                name = one.names[parameter.name]
                first, where = known.setdefault(name, (parameter, one.name))
                if dataclasses.replace(first, name="") != dataclasses.replace(parameter, name=""):
                    raise InputRefusedError(
                        f"{name} is not the same in the measurements '{where}' and '{one.name}'; state it "
                        f"once, or let one of them have its own, such as {one.name}{OF}{parameter.name}."
                    )

    @cached_property
    def parameters(self) -> dict[str, Parameter]:
        """All parameters by their names in the project; those of one quantity by ascending wavelength."""
        found: dict[str, Parameter] = {}
        for one in self.measurements:
            for parameter in one.sample.parameters.values():
                name = one.names[parameter.name]
                found.setdefault(name, dataclasses.replace(parameter, name=name))
        stems = {stem: i for i, stem in enumerate(dict.fromkeys(name.partition("@")[0] for name in found))}

        def place(name: str) -> tuple[int, float]:
            stem, _, wavelength = name.partition("@")
            return stems[stem], float(wavelength or 0)

        return {name: found[name] for name in sorted(found, key=place)}

    @property
    def free(self) -> tuple[Parameter, ...]:
        """The free parameters, by their names in the project."""
        return tuple(p for p in self.parameters.values() if p.free)

    def measured_in(self, name: str) -> tuple[str, ...]:
        """Names of the measurements that have a parameter, which is given by its name in the project."""
        return tuple(one.name for one in self.measurements if name in one.names.values())

    def __len__(self) -> int:
        return len(self.measurements)

    def __getitem__(self, name: str) -> Measurement:
        for one in self.measurements:
            if one.name == name:
                return one
        known = ", ".join(one.name for one in self.measurements)
        raise InputRefusedError(f"there is no measurement '{name}'; the project has: {known}.")

    def card(self) -> Card:
        """Its measurements, and which free parameters they share."""
        rows = [[one.name, one.data.source, str(one.n_points), one.instrument] for one in self.measurements]
        shared = [p for p in self.free if len(self.measured_in(p.name)) > 1]
        own = [p for p in self.free if p not in shared]
        sentences = [
            f"{counted(len(self.free), 'free parameter')}, of which measurements share {len(shared)}."
        ]
        if own:
            sentences.append(f"Of one measurement: {', '.join(p.name for p in own)}.")
        heads = ["measurement", "source", "points", "instrument"]
        title = f"Project{f' {self.title!r}' if self.title else ''} of {counted(len(self), 'measurement')}"
        return Card(title, sentences, (CardTable(heads, rows, (0, 1, 3)),))

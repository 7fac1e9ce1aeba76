"""One measurement as it travels to a worker: the content of its files, its sample and its options."""

import dataclasses
import hashlib
import json
from typing import TYPE_CHECKING, Any

from jaxink.batches.listing import ListedMeasurement
from jaxink.batches.row import ABSENT, Inputs
from jaxink.errors import InputRefusedError
from jaxink.files.reading import read_bounded
from jaxink.sample import Sample, sample_to_dict

if TYPE_CHECKING:
    from jaxink.batches.plan import Plan

# A measurement travels in one message.
_MOST_BYTES = 200_000_000


@dataclasses.dataclass(frozen=True)
class MeasurementTask:
    """What a worker needs for one measurement; it sees neither the plan nor its files.

    Parameters
    ----------
    name
        Of the measurement.
    paths, contents
        Its files, and what is in them.
    sample
        See `sample_to_dict`.
    work, fit, diagnosis, reading, with_figures, checks_input
        See `Plan`.
    inputs
        Digests of all this.
    """

    name: str
    paths: tuple[str, ...]
    contents: tuple[bytes, ...]
    sample: dict[str, Any]
    work: str
    fit: dict[str, Any]
    diagnosis: dict[str, Any]
    reading: dict[str, Any]
    with_figures: bool
    checks_input: bool
    inputs: Inputs


@dataclasses.dataclass(frozen=True)
class Unreadable:
    """A measurement whose files or values are refused before it travels."""

    name: str
    paths: tuple[str, ...]
    inputs: Inputs
    sentence: str


@dataclasses.dataclass(frozen=True)
class Absent(Unreadable):
    """A measurement whose files cannot be read now, which says nothing about an earlier result."""


def task_of(listed: ListedMeasurement, plan: "Plan") -> MeasurementTask | Unreadable:
    """Read the files of a measurement, and put its values into the sample."""
    options = {
        key: getattr(plan, key)
        for key in ("work", "fit", "diagnosis", "reading", "with_figures", "checks_input")
    }
    paths = tuple(map(str, listed.files))
    said = _digest(options)
    try:
        contents = tuple(
            read_bounded(file, _MOST_BYTES, "measurement file", plan.files) for file in listed.files
        )
    except InputRefusedError as problem:
        inputs = Inputs(ABSENT, _sample_digest(listed, plan), said)
        return Absent(listed.name, paths, inputs, str(problem))
    read = hashlib.sha256()
    for file, content in zip(listed.files, contents, strict=True):
        read.update(json.dumps([file.name, len(content)]).encode())
        read.update(content)
    try:
        sample = sample_to_dict(_with_values(plan.sample, listed))
    except InputRefusedError as problem:
        wrong = Inputs(read.hexdigest(), _sample_digest(listed, plan), said)
        return Unreadable(listed.name, paths, wrong, str(problem))
    inputs = Inputs(read.hexdigest(), _digest(sample), said)
    return MeasurementTask(listed.name, paths, contents, sample, inputs=inputs, **options)


def _with_values(sample: Sample, listed: ListedMeasurement) -> Sample:
    """The sample with the values that the table states; a free parameter starts there."""
    parameters = sample.parameters
    for name, value in listed.values.items():
        known = parameters[name]
        if not known.minimum <= value <= known.maximum:
            raise InputRefusedError(
                f"{listed.name}: {name} is {value:g}{known.unit and ' ' + known.unit} in the table of "
                f"measurements; it must lie between {known.minimum:g} and {known.maximum:g}."
            )
    return dataclasses.replace(sample, parameters=parameters.at(listed.values))


def _sample_digest(listed: ListedMeasurement, plan: "Plan") -> str:
    """Digest of the sample as for a task, whatever else is wrong; of the values if these are refused."""
    try:
        return _digest(sample_to_dict(_with_values(plan.sample, listed)))
    except InputRefusedError:
        return _digest(dict(listed.values))


def _digest(data: Any) -> str:
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()

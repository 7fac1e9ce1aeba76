"""Conversion between a sample and plain data for result files."""

import math
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.files.decoding import Rules, decode
from jaxink.files.encoding import plain as as_plain
from jaxink.sample.description import Sample
from jaxink.sample.parameters import Parameter, ParameterTable
from jaxink.sample.soundness import require_sound

# A tied parameter has no value, and a range may be unbounded.
NULLS = {"value": math.nan, "minimum": -math.inf, "maximum": math.inf}
_RULES = Rules(NULLS, {ParameterTable: (tuple[Parameter, ...], ParameterTable)})


def sample_to_dict(sample: Sample) -> dict[str, Any]:
    """Plain data of a sample: strings, numbers, lists and None only; infinite ranges are None."""
    return as_plain(sample) | {"parameters": as_plain(tuple(sample.parameters.values()))}


def sample_from_dict(plain: Any, key: str = "sample") -> Sample:
    """Sample from the data of `sample_to_dict`; invalid data are rejected, with ``key`` as their name."""
    sample = decode(Sample, plain, key, _RULES)
    try:
        require_sound(sample)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{key}: {problem}") from None
    return sample

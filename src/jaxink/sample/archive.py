"""A sample as plain data, for result files, and back."""

import dataclasses
import math
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.files.decoding import Rules, decode
from jaxink.sample.description import Sample
from jaxink.sample.parameters import Parameter, ParameterTable
from jaxink.sample.soundness import require_sound


def sample_to_dict(sample: Sample) -> dict[str, Any]:
    """Plain data of a sample.

    Parameters
    ----------
    sample
        The sample.

    Returns
    -------
    dict
        Of strings, numbers, lists and None only; infinite ranges are None.
    """
    plain = {f.name: getattr(sample, f.name) for f in dataclasses.fields(sample)}
    plain["layers"] = [dataclasses.asdict(layer) for layer in sample.layers]
    plain["backing"] = sample.backing and dataclasses.asdict(sample.backing)
    plain["noise"] = dataclasses.asdict(sample.noise)
    plain["dispersions"] = [dataclasses.asdict(dispersion) for dispersion in sample.dispersions]
    plain["parameters"] = [
        {k: _finite_or_none(v) for k, v in dataclasses.asdict(p).items()} for p in sample.parameters.values()
    ]
    return plain


def sample_from_dict(plain: Any, key: str = "sample") -> Sample:
    """Sample from the data of `sample_to_dict`.

    Parameters
    ----------
    plain
        The data.
    key
        How they are called in a refusal.

    Raises
    ------
    InputRefusedError
        Naming the key, if they are not the data of a sample.
    """
    sample = decode(Sample, plain, key, SAMPLE_RULES)
    try:
        require_sound(sample)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{key}: {problem}") from None
    return sample


# A tied parameter has no value of its own, and a range may have no ends.
NULLS = {"value": math.nan, "minimum": -math.inf, "maximum": math.inf}
SAMPLE_RULES = Rules(NULLS, {ParameterTable: (tuple[Parameter, ...], ParameterTable)})


def _finite_or_none(value):
    return None if isinstance(value, float) and not math.isfinite(value) else value

"""Signatures in ``help`` are short, and annotations stay what they were."""

import inspect
import pydoc
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import ArrayLike, Float
from numpy.typing import ArrayLike as NumpyArrayLike

import jaxink
from jaxink.display.signature import short_type

LONGEST = 300


@pytest.mark.parametrize(
    ("annotation", "words"),
    [
        (Float[np.ndarray, " points"] | None, "Float['points'] | None"),
        (Float[ArrayLike, " points"], "Float['points']"),
        (NumpyArrayLike, "ArrayLike"),
        (NumpyArrayLike | None, "ArrayLike | None"),
        (Sequence[str] | Mapping[str, float], "Sequence[str] | Mapping[str, float]"),
        (Callable[[str, int], None] | None, "Callable | None"),
        (tuple[int, ...], "tuple[int, ...]"),
        (jaxink.FitResult, "FitResult"),
    ],
)
def test_types_in_few_words(annotation, words):
    assert short_type(annotation) == words


@pytest.mark.parametrize(
    "name", [n for n in jaxink.__all__ if inspect.isfunction(getattr(jaxink, n))], ids=lambda name: name
)
def test_no_function_has_a_long_signature(name):
    signature = str(inspect.signature(getattr(jaxink, name)))
    assert len(signature) < LONGEST
    assert "jaxtyping" not in signature
    assert "jaxink." not in signature.replace("'jaxink.", "")


def test_help_shows_it_and_annotations_stay():
    line = pydoc.plain(pydoc.render_doc(jaxink.fit)).splitlines()[2]
    assert line.startswith("fit(data: GonioData | str | Path")
    assert line.endswith("-> FitResult | JointResult")
    assert jaxink.fit.__annotations__["sample"] == jaxink.Sample | str | Path | None
    assert len(str(inspect.signature(jaxink.DiagnosisOptions))) < LONGEST
    assert "Callable[[" not in str(inspect.signature(jaxink.batch))
    # Methods, too.
    assert str(inspect.signature(jaxink.InkTable.interpolated)).endswith("-> Float['...']")

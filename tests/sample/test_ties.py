"""Ties are a bounded language: what cannot be meant is refused at once, by a sentence with the parameter."""

import json
import math

import numpy as np
import pytest

from jaxink.errors import InputRefusedError
from jaxink.sample import parse_sample, sample_from_dict, sample_to_dict
from jaxink.sample.parameters import Parameter, ParameterTable
from jaxink.sample.ties import evaluate_tie
from tests.refused import edited, sentence_of
from tests.samples import GOOD_SAMPLE

ABSURD = [
    (
        "9**9**9**9",
        "the tie '9**9**9**9' raises to the power 3.8742e+08; it must lie between -100 and 100.",
    ),
    (
        "10**20000000*0",
        "the tie '10**20000000*0' raises to the power 2e+07; it must lie between -100 and 100.",
    ),
    ("10**400", "the tie '10**400' raises to the power 400; it must lie between -100 and 100."),
    ("2.0**99999", "the tie '2.0**99999' raises to the power 99999; it must lie between -100 and 100."),
    ("(10**99)**99", "the tie '(10**99)**99' gives no finite real number with the values of the file."),
    ("1e300*1e300", "the tie '1e300*1e300' gives no finite real number with the values of the file."),
    ("1/(1e300*1e300)", "the tie '1/(1e300*1e300)' gives no finite real number with the values of the file."),
    ("(-1)**0.5", "the tie '(-1)**0.5' gives no finite real number with the values of the file."),
    ("0**-1", "the tie '0**-1' divides by zero with the values of the file."),
    ("1e999", "the tie '1e999' gives no finite real number with the values of the file."),
    ("1" * 400, f"the tie '{'1' * 400}' gives no finite real number with the values of the file."),
    ("True", "the tie 'True' may hold numbers, parameter names, + - * / ** and brackets only."),
    ("2j", "the tie '2j' may hold numbers, parameter names, + - * / ** and brackets only."),
    # Python's parser would warn of these.
    ("1or 2", "the tie '1or 2' may hold numbers, parameter names, + - * / ** and brackets only."),
    (r"'\\d'", r"the tie ''\d'' may hold numbers, parameter names, + - * / ** and brackets only."),
    (r"\u0000", r"the tie '\x00' may hold numbers, parameter names, + - * / ** and brackets only."),
    ("", "the tie '' is not an expression."),
    ("(" * 300 + "1" + ")" * 300, f"the tie '{'(' * 300}1{')' * 300}' is not an expression."),
    ("-" * 500 + "1", f"the tie '{'-' * 500}1' has 500 operations; 100 are allowed."),
    ("+".join("1" * 300), f"the tie '{'+'.join('1' * 300)}' has 299 operations; 100 are allowed."),
]


@pytest.mark.parametrize(("tie", "sentence"), ABSURD, ids=[tie[:20] for tie, _ in ABSURD])
def test_absurd_ties_are_refused(tie, sentence, tmp_path):
    text = edited(GOOD_SAMPLE, ("absorption_per_mm = 1.0", f'absorption_per_mm = {{ tie = "{tie}" }}'))
    assert sentence_of(text, tmp_path) == f"ink.absorption_per_mm: {sentence}"


@pytest.mark.parametrize("tie", ["-" * 20_000 + "1", "(" * 20_000, "a." * 20_000 + "a", "1" * 20_000])
def test_long_ties_are_refused_by_a_short_sentence(tie, tmp_path):
    text = edited(GOOD_SAMPLE, ("absorption_per_mm = 1.0", f'absorption_per_mm = {{ tie = "{tie}" }}'))
    sentence = sentence_of(text, tmp_path)
    assert sentence.startswith("ink.absorption_per_mm: the tie ")
    assert sentence.endswith(f" has {len(tie)} characters; 1000 are allowed.")
    assert len(sentence) < 2000


@pytest.mark.parametrize("tie", ["9**9**9**9", "10**20000000*0", "-" * 20_000 + "1", "1or 2"])
def test_absurd_ties_of_a_stored_sample_are_refused(tie):
    plain = json.loads(json.dumps(sample_to_dict(parse_sample(GOOD_SAMPLE))))
    (parameter,) = (p for p in plain["parameters"] if p["name"] == "ink.absorption_per_mm")
    parameter["tie"] = tie
    with pytest.raises(InputRefusedError, match=r"ink\.absorption_per_mm"):
        sample_from_dict(plain)


def test_a_stored_tie_that_is_no_text_is_refused():
    plain = json.loads(json.dumps(sample_to_dict(parse_sample(GOOD_SAMPLE))))
    plain["parameters"][8]["tie"] = 7
    with pytest.raises(InputRefusedError, match=r"sample\.parameters\[8\]\.tie is 7; it must be a text\."):
        sample_from_dict(plain)


def test_ties_compute_as_floats_do():
    values = {"a": 3, "b.c": np.float64(-2.0), "d_1": 0.1}
    assert evaluate_tie("2 * a ** 2 - b.c / 4", values) == 18.5
    assert evaluate_tie("b . c ** 3 + 1_0.5e-1", values) == -6.95
    assert evaluate_tie(" -(-a) ** -2 ", values) == -1 / 9
    assert type(evaluate_tie("a", values)) is float
    assert evaluate_tie("+".join(["d_1"] * 101), values) == pytest.approx(10.1)


def test_numpy_values_that_overflow_are_refused_without_a_warning():
    with pytest.raises(InputRefusedError, match="gives no finite real number"):
        evaluate_tie("a * a", {"a": np.float64(1e300)})


def test_whole_powers_of_traced_values_differentiate_at_zero_and_below():
    import jax

    slope = jax.grad(lambda x: evaluate_tie("x ** 3 + x ** 2", {"x": x}))
    assert slope(0.0) == 0.0
    assert slope(-2.0) == pytest.approx(8.0, rel=1e-15)
    # A power that is not whole keeps its own slope.
    root = jax.grad(lambda x: evaluate_tie("x ** 0.5", {"x": x}))
    assert root(4.0) == pytest.approx(0.25)


def test_long_chains_of_ties_are_resolved():
    n = 3000
    links = [Parameter(f"p{i}", math.nan, tie=f"p{i + 1} + 1") for i in range(n)]
    table = ParameterTable([*links, Parameter(f"p{n}", 0.5)])
    assert table.values_with({})["p0"] == n + 0.5


def test_circles_are_refused_by_those_that_form_them():
    table = [Parameter(name, math.nan, tie=tie) for name, tie in (("a", "b"), ("b", "c"), ("c", "b"))]
    with pytest.raises(
        InputRefusedError, match=r"^the ties of (b, c|c, b) refer to each other in a circle\.$"
    ):
        ParameterTable(table)

import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from jaxink.data import simulated_example
from jaxink.numerics.fingerprint import fingerprint, source_fingerprint
from jaxink.sample import load_sample
from jaxink.solver.config import SolverConfig

DIFFERENT = (
    None,
    True,
    1,
    1.0,
    "1",
    b"1",
    (1,),
    [1],
    ((1,),),
    (1, 1),
    ("11",),
    {"a": 1},
    {"a": (1,)},
    frozenset({1}),
    np.array([1.0]),
    np.array([[1.0]]),
    np.array([1], "int32"),
    SolverConfig(),
    SolverConfig(4, 3, 8, 2),
    SolverConfig,
    load_sample,
)

IN_ANOTHER_PROCESS = """
from jaxink.data import simulated_example
from jaxink.numerics.fingerprint import fingerprint
from jaxink.sample import load_sample
print(fingerprint(load_sample(simulated_example()[1]), frozenset({"a", "b", "c"})))
"""


@dataclasses.dataclass(frozen=True)
class Elsewhere:
    value: float


def test_different_things_have_different_fingerprints():
    assert len({fingerprint(thing) for thing in DIFFERENT}) == len(DIFFERENT)
    assert None not in {fingerprint(thing) for thing in DIFFERENT}
    assert fingerprint(1, 2) != fingerprint(12)


def test_every_number_of_a_sample_counts():
    sample = load_sample(simulated_example()[1])
    numbers = {p.name: p.value for p in sample.parameters.values()}
    assert fingerprint(sample) == fingerprint(load_sample(simulated_example()[1]))
    for name in ("plate.refractive_index", "ink.thickness_um"):
        table = type(sample.parameters)(
            [
                dataclasses.replace(p, value=np.nextafter(p.value, 2)) if p.name == name else p
                for p in sample.parameters.values()
            ]
        )
        assert name in numbers
        assert fingerprint(dataclasses.replace(sample, parameters=table)) != fingerprint(sample)


def test_the_fingerprint_is_the_same_in_another_process():
    here = fingerprint(load_sample(simulated_example()[1]), frozenset({"c", "b", "a"}))
    done = subprocess.run(
        [sys.executable, "-c", IN_ANOTHER_PROCESS],
        env=os.environ | {"PYTHONHASHSEED": "7"},
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert done.stdout.strip() == here


@pytest.mark.parametrize(
    "thing",
    [
        Elsewhere(1.0),
        (1, Elsewhere(1.0)),
        {"a": Elsewhere},
        lambda x: x,
        object(),
        frozenset({Elsewhere(1.0)}),
    ],
    ids=["instance", "in a tuple", "class", "lambda", "object", "in a set"],
)
def test_what_is_defined_elsewhere_has_none(thing):
    assert fingerprint(thing) is None


def test_the_source_is_all_of_the_package():
    import jaxink

    package = Path(jaxink.__file__).parent
    assert len(source_fingerprint()) == 64
    assert sum(1 for _ in package.rglob("*.py")) > 100

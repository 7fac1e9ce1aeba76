"""CONTRIBUTING.md against the code: its map, and one worked example of each thing that people add."""

import inspect
import re
from pathlib import Path

import jax
import numpy as np
import pytest

from jaxink.fitting import Objective
from jaxink.sample import effect_schema
from tests.test_import_direction import LAYERS

TEXT = (Path(__file__).resolve().parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
# What the modules that the examples go into import.
IMPORTS = """
import dataclasses
from pathlib import Path
import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from jaxink.effects import ReadingEffect
from jaxink.export.formats import Format
from jaxink.export.limitations import ExportOptions
from jaxink.export.text import row, write_lines
from jaxink.ink import InkTable
from jaxink.ink.hemispherical_totals import diffuse_totals
from jaxink.optics.phase_function import PhaseFunction
from jaxink.numerics.validity import as_float
from jaxink.particles.phase_function import _henyey_greenstein, _powers
from jaxink.sample import Quantity, terms_of
from jaxink.sample.effect_schema import EFFECTS, EffectKeys
"""


def code_of(name):
    [code] = [code for code in EXAMPLES if name in code]
    return code


def defined(name, before=""):
    names = {}
    exec(IMPORTS + before + code_of(name), names)
    return names[name]


def test_packages_are_listed_from_the_bottom_to_the_top():
    rows = (line.split("|")[1] for line in TEXT.splitlines() if line.startswith("| `"))
    listed = [re.findall(r"`(\w+)`", packages) for packages in rows]
    at = {package: k for k, packages in enumerate(LAYERS) for package in packages}
    names = [name for packages in listed for name in packages]
    assert sorted(names) == sorted(set(at) - {"data", "__main__"})
    layers = [at[name] for name in names]
    assert layers == sorted(layers)


def test_effect_of_the_example_is_complete(monkeypatch):
    names = {}
    exec(f"{IMPORTS}found = {{{code_of('EffectKeys(')}}}", names)
    monkeypatch.setattr(effect_schema, "EFFECTS", effect_schema.EFFECTS | names["found"])
    effect = defined("Vignetting")
    assert not effect.__abstractmethods__
    assert effect().strength.value == 0


@pytest.mark.parametrize("g", [-0.4, 0.0, 0.3, 0.95])
def test_phase_function_of_the_example_has_mean_1_and_its_mean_cosine(g):
    kind = defined("CornetteShanks")
    with jax.enable_x64(True):
        few, many = (np.asarray(kind(g).moments(n)) for n in (2, 24))
        # Cornette, Shanks 1992, eq. 9.
        assert few == pytest.approx([1, 3 * g * (4 + g**2) / (5 * (2 + g**2))], rel=1e-12, abs=1e-12)
        nodes, weights = np.polynomial.legendre.leggauss(400)
        values = np.asarray(kind(g).value(nodes))
        expected = [weights @ (values * np.polynomial.Legendre.basis(n)(nodes)) / 2 for n in range(24)]
    np.testing.assert_allclose(many, expected, atol=1e-10)


def test_format_of_the_example_says_what_is_lost():
    assert "standard_errors" in defined("TOTALS").lost


def test_objective_of_the_example_belongs_to_the_method_that_is_named():
    [code] = [code for code in EXAMPLES if "self.kind" in code]
    assert code.strip().splitlines()[0].startswith("if self.kind ==")
    assert "if self.kind ==" in inspect.getsource(Objective._misfit)

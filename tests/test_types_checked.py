"""While testing, types and shapes of the whole library are checked."""

import importlib
import tomllib
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import TypeCheckError

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src"
OPTION = "--jaxtyping-packages="


def modules():
    paths = (path.relative_to(SOURCE).with_suffix("") for path in SOURCE.rglob("*.py"))
    return sorted(".".join(path.parts).removesuffix(".__init__") for path in paths)


def checked_packages():
    options = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["pytest"]["ini_options"]["addopts"]
    [option] = [option for option in options if option.startswith(OPTION)]
    return option.removeprefix(OPTION).split(",beartype")[0].split(",")


def test_every_module_is_checked():
    packages = checked_packages()
    assert len(modules()) > 100
    left_out = [name for name in modules() if not any(f"{name}.".startswith(f"{p}.") for p in packages)]
    assert not left_out


def test_no_function_or_class_opts_out():
    # What a measurement is given it converts, or refuses itself.
    opting_out = [path.name for path in SOURCE.rglob("*.py") if "no_type_check" in path.read_text()]
    assert opting_out == ["dataset.py"]


@pytest.mark.parametrize(
    ("place", "arguments"),
    [
        ("surfaces.spectrum:tabulated_spectrum", (jnp.ones((3, 1)), jnp.ones(3))),
        ("ink.hemispherical_totals:azimuth_weights", (np.zeros((2, 2)),)),
        ("measurement.pairs:direction_groups", ("a measurement",)),
    ],
)
def test_wrong_shape_or_type_is_refused(place, arguments):
    module, name = place.split(":")
    function = getattr(importlib.import_module(f"jaxink.{module}"), name)
    with pytest.raises(TypeCheckError):
        function(*arguments)

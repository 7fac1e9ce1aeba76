"""Every public object shows itself on a few lines, whatever it holds."""

import dataclasses
import enum
import importlib
import inspect
import re

import numpy as np
import pytest

from jaxink.diagnosis import DiagnosisOptions
from jaxink.display.card import Presented
from jaxink.display.named_rows import NamedRows
from jaxink.fitting import make_objective
from jaxink.fitting.fitted_parameters import FittedParameters
from tests.display.walk import too_long

ROOMS = ("", ".diagnosis", ".effects", ".export", ".fitting", ".ink", ".measurement", ".planning")
ROOMS += (".projects", ".sample")


def public_classes():
    for room in ROOMS:
        module = importlib.import_module(f"jaxink{room}")
        for name in module.__all__:
            kind = getattr(module, name)
            if inspect.isclass(kind) and not issubclass(kind, BaseException | enum.Enum):
                yield pytest.param(kind, id=f"{module.__name__}.{name}")


def has_short_fields(kind):
    """Whether no field can hold an array, a table or any number of values."""
    types = [str(field.type) for field in dataclasses.fields(kind)]
    return not any(
        word in text
        for text in types
        for word in (
            "ndarray",
            "Array",
            "dict",
            "Mapping",
            "list",
            ", ...",
            "Table",
            "Sample",
            "Data",
            "Model",
        )
    )


@pytest.mark.parametrize("kind", list(public_classes()))
def test_a_public_class_shows_itself_briefly(kind):
    if not dataclasses.is_dataclass(kind):
        own = kind.__repr__ not in (object.__repr__, str.__repr__)
        assert not own or kind.__repr__.__module__.startswith(("jaxink.display", "collections", "builtins"))
        return
    of_display = kind.__repr__.__module__.startswith("jaxink.display")
    assert of_display or has_short_fields(kind), f"{kind.__name__} needs __repr__ = brief_repr"


def test_a_fit_and_all_that_it_holds_are_brief(example_result):
    objective = make_objective(example_result.data, example_result.sample, config=example_result.config)
    for one in (example_result, example_result.forward_model(), objective, DiagnosisOptions()):
        assert not too_long(one)


@pytest.mark.parametrize(
    "of", [lambda r: r, lambda r: r.data, lambda r: r.sample], ids=["fit", "data", "sample"]
)
def test_text_and_html_say_the_same(of, example_result):
    shown = of(example_result)
    assert isinstance(shown, Presented)
    for table in shown.card().tables:
        for cell in (cell for row in table.rows for cell in row):
            assert cell in shown.summary()
            assert cell in shown._repr_html_()


def test_parameters_are_one_kind_of_thing(example_result):
    for table in (example_result.parameters, example_result.sample.parameters):
        assert isinstance(table, NamedRows)
        assert list(table) == list(example_result.sample.parameters)
        frame = table.to_frame()
        assert frame.loc["ink.scattering_per_mm", "value"] == table["ink.scattering_per_mm"].value
        assert frame.free.sum() == len(table.free) == 3


def test_a_fitted_parameter_shows_few_digits(example_result):
    shown = repr(example_result["ink.scattering_per_mm"])
    assert f"value={example_result['ink.scattering_per_mm'].value:.6g}" in shown
    assert max(map(len, re.findall(r"[0-9.]+", shown))) <= 8


def test_covariance_is_that_of_the_standard_errors(example_result):
    found = example_result.covariance
    assert found.names == tuple(p.name for p in example_result.parameters.free)
    errors = np.array([example_result[name].standard_error for name in found.names])
    np.testing.assert_allclose(np.sqrt(np.diag(found.matrix)), errors, rtol=1e-12)
    expected = example_result.correlations[0, 2] * errors[0] * errors[2]
    assert found.to_frame().loc[found.names[0], found.names[2]] == pytest.approx(expected, rel=1e-12)


def test_a_parameter_without_error_is_not_in_the_covariance(example_result):
    rows = [
        dataclasses.replace(p, standard_error=None) if p.name == "ink.absorption_per_mm" else p
        for p in example_result.parameters.values()
    ]
    held = dataclasses.replace(example_result, parameters=FittedParameters.of(tuple(rows))).covariance
    whole = example_result.covariance
    assert held.names == (whole.names[0], whole.names[2])
    np.testing.assert_array_equal(held.matrix, whole.matrix[np.ix_([0, 2], [0, 2])])


def test_frame_of_the_data_has_every_point(example_result):
    data = example_result.data
    hidden = data.replace(mask=np.where(np.arange(len(data)) == 3, 32, 0))
    frame = hidden.to_frame()
    assert frame.index.tolist() == data.row.tolist()
    np.testing.assert_array_equal(frame.bsdf_per_sr, data.bsdf_per_sr)
    assert frame.side.tolist() == data.side.tolist()
    assert frame.masked.tolist().count("user") == 1
    assert frame.masked.iloc[3] == "user"
    towards = frame.theta_o_deg[(frame.phi_deg == 0)]
    np.testing.assert_array_equal(frame.signed_theta_o_deg[towards.index], -towards)
    assert (frame.signed_theta_o_deg[frame.phi_deg == 180] >= 0).all()
    fitted = example_result.to_frame()
    np.testing.assert_array_equal(fitted.predicted_per_sr, example_result.predicted_per_sr)
    np.testing.assert_array_equal(fitted.residual_whitened, example_result.whitened)

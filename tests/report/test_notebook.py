"""What a diagnosis and its tables show in a notebook."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.diagnosis import transfer
from jaxink.display.named_rows import NamedRows
from tests.display.walk import too_long


def test_a_diagnosis_and_all_that_it_holds_are_brief(found, change):
    assert not too_long(found)
    assert not too_long(change.before)


def test_summary_and_html_hold_the_verdict_and_the_effect(found):
    for text in (found.summary(), found._repr_html_()):
        assert found.verdict.code in text
        assert found.steps[0].effect in text
        assert f"{found.after.fitted.reduced_chi_square:.4g}" in text
    assert found.verdict.sentence.split()[0] in found.summary()


def test_parameters_are_one_kind_of_thing(found):
    moved = transfer(found, found.declared.data, is_refitted=False)
    for table in (found.parameters, found.parameters_before, found.parameters_after, moved.parameters):
        assert isinstance(table, NamedRows)
        frame = table.to_frame()
        assert list(frame.columns) == ["value", "standard_error"]
        assert frame.loc["ink.scattering_per_mm", "value"] == table["ink.scattering_per_mm"].value
    assert found.parameters == found.parameters_after


def test_an_ink_table_shows_its_components(change):
    text = change.before.summary()
    for component in ("R_II", "T_IA", "T_AI", "R_AA"):
        assert component in text


def test_a_corrected_model_has_a_log_density_and_compiles(found):
    corrected = found.corrected
    with jax.enable_x64(True):
        density = corrected.log_density
        assert "stray_light.level_per_sr" in density.free
        values = {name: corrected.values[name] for name in density.free}
        rows, _ = density.objective.residual_at(jnp.array(list(values.values())))
        assert float(np.sum(rows**2)) == pytest.approx(corrected.merit.chi_square, rel=1e-9)
        assert np.all(np.isfinite(list(jax.jit(jax.grad(density))(values).values())))
        model = corrected.forward_model()
        np.testing.assert_allclose(jax.jit(model.bsdf)(values), corrected.predict(), rtol=1e-9)

"""Flags of JAX that a user's own code sets: the same fit, or a sentence that names the flag."""

import os
import subprocess
import sys

import jax
import numpy as np
import pytest

import jaxink
from jaxink.data import SIMULATED_TRUTH, simulated_example
from jaxink.errors import PlatformError, PrecisionError
from jaxink.numerics.precision import computing

STRICT = {
    "jax_numpy_dtype_promotion": "strict",
    "jax_numpy_rank_promotion": "raise",
    "jax_disable_jit": True,
    "jax_transfer_guard": "disallow",
}
REFUSED = {flag: value for flag, value in STRICT.items() if flag != "jax_disable_jit"}


@pytest.fixture
def setting(monkeypatch):
    """Set a flag until the end of a test, without programs that were made before."""
    monkeypatch.setenv("JAXINK_CACHE_DIR", "")
    before = {flag: getattr(jax.config, flag) for flag in STRICT}

    def change(flag, value):
        jax.clear_caches()
        jax.config.update(flag, value)

    yield change
    for flag, value in before.items():
        jax.config.update(flag, "allow" if value is None else value)


@pytest.mark.parametrize(("flag", "value"), STRICT.items())
def test_a_fit_does_not_depend_on_flags_and_leaves_them(flag, value, setting, example_result, coarse):
    setting(flag, value)
    options = jaxink.FitOptions(config=coarse, profile="none")
    result = jaxink.fit(*simulated_example(), options)
    assert getattr(jax.config, flag) == value
    for name in SIMULATED_TRUTH:
        assert result.values[name] == pytest.approx(example_result.values[name], rel=1e-9)
    predicted = result.predict()
    assert getattr(jax.config, flag) == value
    np.testing.assert_allclose(predicted, example_result.predict(), rtol=1e-9)


def test_all_flags_are_lenient_while_jaxink_computes_also_after_an_error(setting):
    for flag, value in STRICT.items():
        setting(flag, value)
    with computing():
        assert jax.config.jax_numpy_dtype_promotion == "standard"
        assert jax.config.jax_numpy_rank_promotion == "allow"
        assert not jax.config.jax_disable_jit
        assert jax.config.jax_transfer_guard_host_to_device == "allow"
    with pytest.raises(KeyError), computing():
        raise KeyError
    assert {flag: getattr(jax.config, flag) for flag in STRICT} == STRICT


@pytest.mark.parametrize(("flag", "value"), REFUSED.items())
def test_differentiable_functions_name_the_flag_and_the_context_that_helps(
    flag, value, setting, example_result, coarse, told
):
    truth = {name: jax.device_put(np.float64(at)) for name, at in SIMULATED_TRUTH.items()}
    model = jaxink.forward_model(example_result.sample, example_result.data, coarse)
    density = example_result.log_density
    layer = jaxink.ScatteringLayer(1.5, 2.0, 0.9, jaxink.HenyeyGreenstein(0.6))
    stack, sines = jaxink.Stack((layer,), 1.0, 1.0), np.array([0.1, 0.5])
    setting(flag, value)
    for call in (
        lambda: model.bsdf(truth),
        lambda: jax.jit(jax.grad(lambda values: model.bsdf(values).sum()))(truth),
        lambda: density(truth),
        lambda: jaxink.hemispherical_power(stack, sines),
        lambda: jaxink.regular_power(stack, sines),
    ):
        with pytest.raises(PrecisionError) as problem:
            call()
    sentence = told(str(problem.value), flag.removeprefix("jax_"), value, "with jax.")
    context = sentence.split("`with jax.")[1].split(":`")[0]
    name, _, setting_in_context = context.partition("(")
    with getattr(jax, name)(setting_in_context.strip('")')):
        slopes = jax.grad(lambda values: model.bsdf(values).sum())(truth)
    assert all(np.isfinite(slope) for slope in slopes.values())


@pytest.mark.parametrize("platform", ["cuda", "rocm,cpu"])
def test_a_platform_without_a_device_is_named_with_its_variable(platform, tmp_path, told):
    data, sample = map(str, simulated_example())
    done = subprocess.run(
        [sys.executable, "-m", "jaxink", "fit", data, "--sample", sample, "--out", "out"],
        cwd=tmp_path,
        env={**os.environ, "JAX_PLATFORMS": platform},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    if done.returncode == 0:
        pytest.skip("this machine has such a device")
    assert done.returncode == 1
    sentence = told(done.stderr, "jaxink: ", platform, "JAX_PLATFORMS=cpu")
    assert sentence.count("\n") <= 1
    assert list(tmp_path.iterdir()) == []
    assert issubclass(PlatformError, RuntimeError)

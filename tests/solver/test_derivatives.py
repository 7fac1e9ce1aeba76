"""Derivatives of the BSDF: forward, reverse and central differences, at ordinary and at degenerate points."""

from importlib.metadata import version

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink import ClearLayer, Directions, ScatteringLayer, SolverConfig, Stack, diffuse_bsdf, plan_channels
from jaxink.errors import PrecisionError
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.layer_response import LAYER_METHODS, layer_response

CONFIG = SolverConfig(6, 4, 12, 3)
DIRECTIONS = Directions.from_degrees(
    [0.0, 30.0, 30.0, 60.0], [20.0, 40.0, 10.0, 70.0], [0.0, 180.0, 90.0, 35.0], [False, True, False, True]
)


def model(method):
    """BSDF of plate and ink in air, compiled with its derivatives in both modes.

    x = albedo, log of optical thickness, asymmetry parameter, index of the ink.
    """
    config = SolverConfig(6, 4, 12, 3, method)

    def stack(x):
        ink = ScatteringLayer(x[3], jnp.exp(x[1]), x[0], HenyeyGreenstein(x[2]))
        return Stack((ClearLayer(1.49, 0.02), ink), 1.0, 1.0)

    plan = plan_channels(stack([0.9, 0.0, 0.5, 1.5]), free=[2])

    def bsdf(x):
        return diffuse_bsdf(stack(x), DIRECTIONS, config, plan)

    return jax.jit(bsdf), jax.jit(jax.jacfwd(bsdf)), jax.jit(jax.jacrev(bsdf))


MODELS = {method: model(method) for method in LAYER_METHODS}
bsdf = MODELS["discrete_ordinates"][0]

POINTS = {
    "ordinary": [0.95, np.log(3.0), 0.6, 1.56],
    "conservative": [1.0, np.log(3.0), 0.6, 1.56],
    "black": [0.0, np.log(3.0), 0.6, 1.56],
    "isotropic": [0.9, np.log(3.0), 0.0, 1.56],
    "backward": [0.9, np.log(3.0), -0.7, 1.56],
    "thin": [0.9, np.log(1e-6), 0.6, 1.56],
    "thick": [0.99, np.log(1e4), 0.6, 1.56],
    "thick and conservative": [1.0, np.log(1e3), 0.6, 1.56],
    "narrow forward peak": [0.9, np.log(3.0), 0.98, 1.56],
    "narrow backward peak": [0.9, np.log(3.0), -0.98, 1.56],
    "ink below the plate": [0.95, np.log(3.0), 0.6, 1.45],
    "ink of the plate's index": [0.95, np.log(3.0), 0.6, 1.49],
}


@pytest.mark.parametrize("method", LAYER_METHODS)
@pytest.mark.parametrize("name", POINTS)
def test_forward_equals_reverse_equals_differences(name, method):
    bsdf, forward, reverse = MODELS[method]
    x = jnp.array(POINTS[name])
    here = np.asarray(forward(x))
    assert np.all(np.isfinite(here))
    size = np.max(np.abs(here), axis=0)
    # A BSDF has an absolute rounding of 1e-16 or so, which a layer of thickness 1e-6 shows.
    assert np.asarray(reverse(x)) == pytest.approx(here, abs=1e-10 * size.max() + 1e-15)
    for k in range(4):
        # The albedo may not leave 0 ... 1: one-sided differences there. In a thick layer a loss of 1 / tau^2
        # already matters.
        one_sided = k == 0 and name in ("conservative", "thick and conservative", "black")
        # Above the plate's index a block of trapped channels opens, whose nodes are not dense at once.
        one_sided |= k == 3 and name == "ink of the plate's index"
        size_of_step = 1e-9 if k == 0 and name == "thick and conservative" else 1e-5
        step = size_of_step * np.eye(4)[k] * (-1 if one_sided and name != "black" else 1)
        if one_sided:
            slope = (-3 * bsdf(x) + 4 * bsdf(x + step) - bsdf(x + 2 * step)) / (2 * step[k])
        else:
            slope = (bsdf(x + step) - bsdf(x - step)) / (2 * step[k])
        # The zero eigenvalue of a thick conservative layer carries a rounding that grows with tau; doubling a
        # thick layer adds up that of some thirty products.
        rounding = {"thick and conservative": 1e-11, "thick": 1e-14}.get(name, 1e-15) / size_of_step
        assert here[:, k] == pytest.approx(np.asarray(slope), abs=1e-5 * size[k] + 20 * rounding)


def test_zero_thickness_has_the_derivative_of_a_thin_layer():
    a = jnp.diag(jnp.array([1.2, 2.0, 5.0]))[None]
    b = a - 0.3

    def transmission(half):
        return layer_response(a, b, half)[1]

    at_zero = jax.jacfwd(transmission)(jnp.asarray(0.0))
    assert np.asarray(transmission(jnp.asarray(0.0)))[0] == pytest.approx(np.eye(3), abs=1e-12)
    # dT/dh = -(A + B) for T = 1 - (A + B) h.
    assert np.asarray(at_zero)[0] == pytest.approx(-np.asarray(a + b)[0], rel=1e-6)


@pytest.mark.parametrize("method", LAYER_METHODS)
# In a film of no thickness at all, light that is trapped without loss has no limit but its own rounding.
@pytest.mark.parametrize(("index", "tolerance"), [(1.0, 1e-5), (1.5, 1e-3)])
def test_stack_of_zero_thickness_has_a_slope_in_it(index, tolerance, method):
    config = SolverConfig(6, 4, 12, 3, method)

    @jax.jit
    def of_thickness(thickness):
        ink = ScatteringLayer(index, thickness, 0.9, HenyeyGreenstein(0.4))
        return diffuse_bsdf(Stack((ink,), 1.0, 1.0), DIRECTIONS, config)

    slope = np.asarray(jax.jacfwd(of_thickness)(0.0))
    h = 1e-6
    difference = (4 * of_thickness(h) - of_thickness(2 * h) - 3 * of_thickness(0.0)) / (2 * h)
    assert np.all(slope > 0)
    assert slope == pytest.approx(np.asarray(difference), rel=tolerance)
    assert np.asarray(jax.jacrev(of_thickness)(0.0)) == pytest.approx(slope, rel=1e-3 * tolerance)


def test_equal_eigenvalues_are_an_ordinary_point():
    def reflection(e):
        a = jnp.diag(jnp.array([2.0, 2.0, 2.0])) + e * jnp.array([[0, 1, 0], [1, 0, 0], [0, 0, 0.5]])
        return layer_response(a[None], 0.5 * jnp.eye(3)[None], jnp.asarray(0.7))[0][0]

    slope = np.asarray(jax.jacfwd(reflection)(0.0))
    difference = (reflection(1e-5) - reflection(-1e-5)) / 2e-5
    assert np.all(np.isfinite(slope))
    assert slope == pytest.approx(np.asarray(difference), abs=1e-9)


def test_batches_of_parameters_are_the_single_ones():
    batch = jnp.array([POINTS["ordinary"], POINTS["isotropic"]])
    both = np.asarray(jax.jit(jax.vmap(bsdf))(batch))
    assert both[0] == pytest.approx(np.asarray(bsdf(batch[0])), rel=1e-11)
    assert both[1] == pytest.approx(np.asarray(bsdf(batch[1])), rel=1e-11)


def test_32_bits_raise_a_sentence_instead_of_losing_digits(refused):
    stack = Stack((ScatteringLayer(1.5, 1.0, 0.9, HenyeyGreenstein(0.5)),), 1.0, 1.0)
    with jax.enable_x64(False), refused("64", kind=PrecisionError):
        jax.grad(lambda s: jnp.sum(diffuse_bsdf(stack, DIRECTIONS, CONFIG)) * s)(1.0)


@pytest.mark.parametrize("level", [0, 1, 2])
def test_an_empty_block_of_channels_has_no_slope(level):
    # Two media whose index is the same number and free: between them is a block of no width, whose cosine the
    # compiler may round to a tiny number instead of 0.
    def stack(index):
        upper = ScatteringLayer(index, 0.3, 0.999, HenyeyGreenstein(0.8))
        return Stack((upper, ScatteringLayer(index, 50.0, 0.999, HenyeyGreenstein(0.4))), 1.0, 1.0)

    plan = plan_channels(stack(1.02), free=[1, 2])
    assert plan.block_media == (0, 1, 2)
    options = {"xla_backend_optimization_level": level}
    if version("jaxlib").startswith("0.9."):
        options["xla_cpu_use_fusion_emitters"] = False

    def bsdf(index):
        return diffuse_bsdf(stack(index), DIRECTIONS, CONFIG, plan)

    slope = jax.jit(jax.jacfwd(bsdf), compiler_options=options)
    found = [slope(index) for index in np.random.default_rng(8).uniform(1.01, 1.6, 40)]
    assert np.isfinite(found).all()

"""Regular light in a stack: Fresnel slabs in closed form, sums of all multiple reflections, laws of power."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.solver.specular import attenuation, regular_fields

fields_of = jax.jit(regular_fields)
# Sines times the index of the outside: the normal, Brewster's angle of 1.5, near grazing, and one that only
# a dense medium carries.
KAPPA = np.array([0.0, np.sin(np.arctan(1.5)), 0.999, 1.2])


def squared_cosines(indices):
    return 1 - (KAPPA / np.asarray(indices, float)[:, None]) ** 2


def regular(indices, optical_thickness, kept=None):
    indices, thickness = jnp.asarray(indices, float), jnp.asarray(optical_thickness, float)
    return fields_of(indices, jnp.asarray(squared_cosines(indices)), thickness, kept)


def fresnel(n_1, n_2):
    """Unpolarised power reflectance of each channel, of complex cosines; 1 where it is evanescent in one."""
    mu_1, mu_2 = (np.sqrt(1 - (KAPPA / n) ** 2 + 0j) for n in (n_1, n_2))
    r_s = (n_1 * mu_1 - n_2 * mu_2) / (n_1 * mu_1 + n_2 * mu_2)
    r_p = (n_2 * mu_1 - n_1 * mu_2) / (n_2 * mu_1 + n_1 * mu_2)
    return (np.abs(r_s) ** 2 + np.abs(r_p) ** 2) / 2


@pytest.mark.parametrize("optical_thickness", [0.0, 0.3, 50.0])
@pytest.mark.parametrize("index", [1.0, 1.33, 1.5, 2.4])
def test_a_slab_in_air_is_airys_incoherent_sum(index, optical_thickness):
    found = regular([1.0, index, 1.0], [optical_thickness])
    faces, outside = fresnel(1.0, index), KAPPA < 1
    r, a = faces[outside], np.exp(-optical_thickness / np.sqrt(1 - (KAPPA[outside] / index) ** 2))
    reflection = r + (1 - r) ** 2 * a**2 * r / (1 - r**2 * a**2)
    transmission = (1 - r) ** 2 * a / (1 - r**2 * a**2)
    np.testing.assert_allclose(found.reflection[outside], reflection, rtol=1e-12)
    np.testing.assert_allclose(found.transmission[outside], transmission, rtol=1e-12, atol=1e-30)
    np.testing.assert_array_equal(found.transmission[~outside], 0)
    np.testing.assert_allclose(found.interfaces, np.array([faces, faces]), rtol=1e-12)


def all_reflections(indices, optical_thickness, from_back=False, kept=None):
    """Sum of the rounds of light between the faces until none is left: down and up at either side of each.

    Returns what comes to each face from its front and from its back, and what leaves in front and behind.
    """
    faces = np.array([fresnel(*pair) for pair in zip(indices[:-1], indices[1:], strict=True)])
    r_front, r_back, t = faces, faces, 1 - faces
    if kept is not None:
        r_front, r_back, t = (
            share * factor for share, factor in zip((r_front, r_back, t), kept, strict=True)
        )
    cosine = np.sqrt(np.maximum(squared_cosines(indices)[1:-1], 0))
    with np.errstate(divide="ignore"):
        passed = np.exp(-np.asarray(optical_thickness)[:, None] / cosine)
    passed[cosine == 0] = 0
    m = len(faces)
    down, up = np.zeros((2, m, len(KAPPA)))
    (up if from_back else down)[-1 if from_back else 0] = 1
    to_front, to_back, in_front, behind = np.zeros_like(down), np.zeros_like(down), 0.0, 0.0
    for _ in range(20_000):
        to_front, to_back = to_front + down, to_back + up
        going_up, going_down = r_front * down + t * up, t * down + r_back * up
        in_front, behind = in_front + going_up[0], behind + going_down[-1]
        down, up = np.zeros_like(down), np.zeros_like(up)
        down[1:], up[:-1] = passed * going_down[:-1], passed * going_up[1:]
        if max(down.max(), up.max()) < 1e-18:
            return to_front, to_back, in_front, behind
    raise AssertionError("light is left after all rounds")


STACKS = {
    "plate on ink": ([1.0, 1.5, 1.53, 1.0], [0.02, 0.8]),
    "three layers into glass": ([1.0, 1.3, 1.6, 1.45, 1.5], [0.1, 0.4, 0.05]),
    "air gap": ([1.0, 1.5, 1.0, 1.6, 1.33], [0.3, 0.2, 0.1]),
}


@pytest.mark.parametrize(("indices", "thickness"), STACKS.values(), ids=STACKS)
def test_fields_are_sums_of_all_reflections(indices, thickness):
    found = regular(indices, thickness)
    down, up, in_front, behind = all_reflections(indices, thickness)
    cosine = np.sqrt(np.maximum(squared_cosines(indices)[1:-1], 0))
    np.testing.assert_allclose(found.cosines, cosine, rtol=1e-12)
    # Only channels that propagate in front enter there, and those that propagate behind at the back.
    enters, close = indices[0] > KAPPA, {"rtol": 1e-11, "atol": 1e-15}
    for name, expected in {
        "reflection": in_front,
        "transmission": behind,
        "arriving_from_front": down,
        "returning_from_front": up,
    }.items():
        np.testing.assert_allclose(
            getattr(found, name)[..., enters], expected[..., enters], **close, err_msg=name
        )
    # At the top of each layer, just inside: what has passed the face above; going up at its bottom likewise.
    faces = np.asarray(found.interfaces)
    top = (1 - faces[:-1]) * down[:-1] + faces[:-1] * up[:-1]
    bottom = faces[1:] * down[1:] + (1 - faces[1:]) * up[1:]
    np.testing.assert_allclose(found.down_from_front[:, enters], top[:, enters], **close)
    np.testing.assert_allclose(found.up_from_front[:, enters], bottom[:, enters], **close)
    down, up, *_ = all_reflections(indices, thickness, from_back=True)
    enters = indices[-1] > KAPPA
    np.testing.assert_allclose(found.arriving_from_back[:, enters], up[:, enters], **close)
    np.testing.assert_allclose(found.returning_from_back[:, enters], down[:, enters], **close)
    top = (1 - faces[:-1]) * down[:-1] + faces[:-1] * up[:-1]
    bottom = faces[1:] * down[1:] + (1 - faces[1:]) * up[1:]
    np.testing.assert_allclose(found.down_from_back[:, enters], top[:, enters], **close)
    np.testing.assert_allclose(found.up_from_back[:, enters], bottom[:, enters], **close)


@pytest.mark.parametrize(("indices", "thickness"), STACKS.values(), ids=STACKS)
def test_turned_round_it_is_the_same_stack(indices, thickness):
    forward, backward = regular(indices, thickness), regular(indices[::-1], thickness[::-1])
    np.testing.assert_allclose(backward.transmission, forward.transmission, rtol=1e-12)
    for name in ("down", "arriving", "returning", "up"):
        front, back = f"{name}_from_front", f"{name}_from_back"
        if name in ("down", "up"):
            back = {"down": "up_from_back", "up": "down_from_back"}[name]
        np.testing.assert_allclose(
            getattr(backward, front), getattr(forward, back)[::-1], rtol=1e-12, atol=1e-300, err_msg=name
        )


@pytest.mark.parametrize("indices", [stack[0] for stack in STACKS.values()], ids=STACKS)
def test_layers_that_absorb_nothing_keep_all_light(indices):
    found = regular(indices, np.zeros(len(indices) - 2))
    enters = indices[0] > KAPPA
    np.testing.assert_allclose((found.reflection + found.transmission)[enters], 1, rtol=1e-12)
    # Net flux is the same everywhere.
    net = (found.down_from_front - found.up_from_front)[:, enters]
    expected = np.broadcast_to(found.transmission[enters], net.shape)
    np.testing.assert_allclose(net, expected, rtol=1e-9, atol=1e-12)


def test_light_is_totally_reflected_where_it_cannot_leave():
    found = regular([1.5, 1.4, 1.0], [0.0])
    guided = KAPPA > 1
    np.testing.assert_allclose(found.reflection[guided], 1, rtol=1e-12)
    np.testing.assert_array_equal(found.transmission[guided], 0)
    # In the layer it goes down, and the same up again.
    np.testing.assert_allclose(found.down_from_front[:, guided], found.up_from_front[:, guided], rtol=1e-12)


def test_rough_faces_keep_their_shares_only():
    indices, thickness = [1.0, 1.5, 1.4, 1.33], [0.1, 0.2]
    kept = np.random.default_rng(1).uniform(0.2, 1, (3, 3, len(KAPPA)))
    kept[:, 1] = 1
    found = regular(indices, thickness, jnp.asarray(kept))
    down, up, in_front, behind = all_reflections(indices, thickness, kept=kept)
    enters = KAPPA < 1
    np.testing.assert_allclose(found.reflection[enters], in_front[enters], rtol=1e-11)
    np.testing.assert_allclose(found.transmission[enters], behind[enters], rtol=1e-11)
    np.testing.assert_allclose(found.arriving_from_front[:, enters], down[:, enters], rtol=1e-11)
    np.testing.assert_allclose(found.returning_from_front[:, enters], up[:, enters], rtol=1e-11)
    # The faces themselves are told without what is lost at them.
    np.testing.assert_allclose(found.interfaces, regular(indices, thickness).interfaces)


def test_attenuation_is_beers_law_and_nothing_passes_sideways():
    found = attenuation(jnp.asarray(0.5), jnp.array([1.0, 0.5, 1e-8, 0.0]))
    np.testing.assert_allclose(found, [np.exp(-0.5), np.exp(-1.0), 0, 0], rtol=1e-14)
    slope = jax.grad(lambda mu: attenuation(0.5, mu).sum())(jnp.array([0.5, 0.0]))
    np.testing.assert_allclose(slope, [np.exp(-1.0) * 0.5 / 0.25, 0], rtol=1e-12)


def test_derivatives_are_finite_where_channels_are_grazing_and_trapped():
    thickness = jnp.zeros(3)

    def leaving(indices):
        squared = 1 - (jnp.array([0.0, 1.0, 1.4]) / indices[:, None]) ** 2
        found = regular_fields(indices, squared, thickness, None)
        return found.reflection.sum() + found.transmission.sum() + found.down_from_front.sum()

    # Between two gaps of air the third channel is trapped without loss, and nothing excites it.
    slope = jax.jit(jax.grad(leaving))(jnp.array([1.0, 1.0, 1.5, 1.0, 1.0]))
    assert np.all(np.isfinite(slope))

"""Elements put together: against the equations of the light between them, and by laws of all elements.

Any element sends on light from above (reflection ``above``, transmission ``down``) and from below (``below``,
``up``). Between two of them light goes down and up at once: a linear system, which `between_elements` solves
for any number of elements and which knows nothing of the star product.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.errors import InputRefusedError
from jaxink.solver.layer_response import layer_response
from jaxink.solver.star_product import (
    BackingResponse,
    Nothing,
    RoughElement,
    StackAssembly,
    add_diagonal,
    add_layer,
    add_rough,
    join,
)

N = 4
ORDERS = 2
NOBODY = Nothing()
# Azimuthal order 0 of unit flux in each channel: shares of power add up with these weights.
WEIGHT = np.sqrt([0.1, 0.2, 0.3, 0.4])
MU = np.array([0.2, 0.45, 0.7, 0.95])


def dense(element):
    """(above, below, down, up) of order 0 as matrices, of whatever kind."""
    if isinstance(element, RoughElement):
        return tuple(np.asarray(part[0]) for part in (element.above, element.below, element.down, element.up))
    if len(element) == 2:
        reflection, transmission = (np.asarray(part[0]) for part in element)
        return reflection, reflection, transmission, transmission
    above, below, through = (np.diag(part) for part in element)
    return above, below, through, through


def between_elements(elements, from_below=False):
    """Reflection and transmission of elements, from the front to the back, for unit light in each channel."""
    m = len(elements)
    # Unknown: light going down below element k, and up above it, in turn.
    system, known = np.eye(2 * m * N), np.zeros((2 * m * N, N))
    down = [slice(2 * k * N, (2 * k + 1) * N) for k in range(m)]
    up = [slice((2 * k + 1) * N, (2 * k + 2) * N) for k in range(m)]
    for k, element in enumerate(elements):
        r_above, r_below, t_down, t_up = dense(element)
        for row, onward, back in ((down[k], t_down, r_below), (up[k], r_above, t_up)):
            if k:
                system[row, down[k - 1]] -= onward
            elif not from_below:
                known[row] += onward
            if k < m - 1:
                system[row, up[k + 1]] -= back
            elif from_below:
                known[row] += back
    light = np.linalg.solve(system, known)
    out_above, out_below = light[up[0]], light[down[-1]]
    return (out_below, out_above) if from_below else (out_above, out_below)


def put(element, below):
    """The element in front, by the function of its kind."""
    if isinstance(element, RoughElement):
        return add_rough(element, below)
    return add_layer(*element, below) if len(element) == 2 else add_diagonal(element, below)


def together(elements, below=NOBODY):
    for element in reversed(elements):
        below = put(element, below)
    return below


def of_order_0(part):
    """A vector is a diagonal matrix, and only what scatters has azimuthal orders."""
    part = np.asarray(part)
    return np.diag(part) if part.ndim == 1 else part[0] if part.ndim == 3 else part


def smooth(seed):
    """An interface between two media, as all of them the same from either side; a clear layer behind it."""
    random = np.random.default_rng(seed)
    reflectance, passed = random.uniform(0.02, 0.9, N), random.uniform(0.5, 1, N)
    return tuple(map(jnp.asarray, (reflectance, reflectance * passed**2, (1 - reflectance) * passed)))


def scattering(seed, loss=0.1):
    """Symmetric reflection and transmission that send on all light but a share."""
    random = np.random.default_rng(seed)
    share = random.uniform(0.3, 0.7)
    halves = [symmetric_of_unit_power(random) for _ in range(2 * ORDERS)]
    parts = np.array(halves).reshape(2, ORDERS, N, N) * (1 - loss)
    return jnp.asarray(share * parts[0]), jnp.asarray((1 - share) * parts[1])


def symmetric_of_unit_power(random):
    """Symmetric, and WEIGHT is its eigenvector of eigenvalue 1: it keeps the power of order 0."""
    rest = random.standard_normal((N, N))
    rest = rest - np.outer(rest @ WEIGHT, WEIGHT)
    rest = rest.T - np.outer(rest.T @ WEIGHT, WEIGHT)
    rest = rest + rest.T
    return np.outer(WEIGHT, WEIGHT) + 0.5 * rest / np.linalg.norm(rest, 2)


def rough(seed, loss=0.1):
    """A rough interface: other reflections on its two sides, transmissions transposed to each other."""
    random = np.random.default_rng(seed)
    above, below, down = (
        jnp.asarray(share * (1 - loss) * np.array([symmetric_of_unit_power(random) for _ in range(ORDERS)]))
        for share in (0.3, 0.3, 0.7)
    )
    turned = jnp.asarray(np.linalg.qr(random.standard_normal((N - 1, N - 1)))[0])
    # Not symmetric, and still of unit power from either side.
    basis = np.linalg.qr(np.column_stack([WEIGHT, random.standard_normal((N, N - 1))]))[0]
    turn = (
        basis @ np.block([[np.ones((1, 1)), np.zeros((1, N - 1))], [np.zeros((N - 1, 1)), turned]]) @ basis.T
    )
    down = down @ turn
    return RoughElement(above, below, down, jnp.swapaxes(down, -1, -2), above, below, down)


FACE, PLATE, INK, PAINT, FROSTED = smooth(1), smooth(2), scattering(3), scattering(4), rough(5)
STACKS = {
    "faces": (FACE, PLATE, smooth(6)),
    "ink": (INK,),
    "ink behind a plate": (FACE, PLATE, INK),
    "ink in front of a plate": (INK, FACE, PLATE),
    "ink between plates": (FACE, INK, PLATE),
    "two inks": (INK, PAINT),
    "inks and faces": (FACE, INK, PLATE, PAINT, smooth(6)),
    "frosted face alone": (FROSTED,),
    "frosted plate": (FACE, FROSTED),
    "frosted outside": (FROSTED, PLATE, INK),
    "frosted inside": (FACE, INK, FROSTED, PAINT, PLATE),
}


def one_way(seed):
    """A face that is not reciprocal, as a table of a face measured or computed coarsely is not quite."""
    random = np.random.default_rng(seed)
    above, below, down, up = (
        jnp.asarray(share * random.uniform(0, 1 / N, (ORDERS, N, N))) for share in (0.4, 0.4, 0.6, 0.5)
    )
    return RoughElement(above, below, down, up, above, below, down)


NOT_RECIPROCAL = {
    "one way behind a plate": (FACE, one_way(15)),
    "one way in front of a plate": (one_way(15), FACE),
    "one way between inks": (FACE, PAINT, one_way(15), INK, PLATE),
}


@pytest.mark.parametrize(
    "elements", [*STACKS.values(), *NOT_RECIPROCAL.values()], ids=[*STACKS, *NOT_RECIPROCAL]
)
def test_light_between_the_elements_is_in_balance(elements):
    found = together(elements)
    for part, expected in zip(found[:2], between_elements(elements), strict=True):
        np.testing.assert_allclose(of_order_0(part), expected, rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize("elements", STACKS.values(), ids=STACKS)
def test_a_pile_gives_the_same(elements):
    pile = StackAssembly(NOBODY)
    for element in reversed(elements):
        if isinstance(element, RoughElement):
            pile = pile.with_rough(element)
        elif len(element) == 2:
            pile = pile.with_layer(*element, jnp.zeros(N))
        else:
            pile = pile.with_diagonal(element)
    found = pile.closed().below
    for part, expected in zip(found[:2], between_elements(elements), strict=True):
        np.testing.assert_allclose(of_order_0(part), expected, rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize("elements", STACKS.values(), ids=STACKS)
def test_light_from_behind_comes_out_in_front_and_back(elements):
    light = jnp.asarray(np.random.default_rng(7).uniform(size=N))
    nothing_yet = BackingResponse.of(jnp.asarray(0.5), light)
    found = together(elements, NOBODY._replace(from_behind=nothing_yet)).from_behind
    reflection, transmission = between_elements(elements, from_below=True)
    np.testing.assert_allclose(found.passed, transmission @ light, rtol=1e-11)
    assert float(found.returned) == pytest.approx(float(light @ reflection @ light), rel=1e-11)


@pytest.mark.parametrize("elements", STACKS.values(), ids=STACKS)
def test_turned_round_it_transmits_the_transpose(elements):
    def turned(element):
        if isinstance(element, RoughElement):
            e = element
            return RoughElement(e.below, e.above, e.up, e.down, e.one_below, e.one_above, e.up)
        return element if len(element) == 2 else (element[1], element[0], element[2])

    forward, backward = together(elements), together([turned(e) for e in reversed(elements)])
    transmissions = of_order_0(forward.transmission), of_order_0(backward.transmission)
    np.testing.assert_allclose(transmissions[1], transmissions[0].T, rtol=1e-11, atol=1e-14)
    # Reciprocity: what is reflected is symmetric.
    reflection = of_order_0(forward.reflection)
    np.testing.assert_allclose(reflection, reflection.T, rtol=1e-11, atol=1e-14)


def test_what_loses_no_light_keeps_it_however_it_is_put_together():
    reflectance = jnp.asarray(np.random.default_rng(8).uniform(0.1, 0.9, N))
    face = (reflectance, reflectance, 1 - reflectance)
    found = together((face, scattering(9, 0.0), rough(10, 0.0), face, scattering(11, 0.0)))
    # A face that reflects channels unequally mixes no channels: its columns conserve power one by one.
    power = WEIGHT @ of_order_0(found.reflection) + WEIGHT @ of_order_0(found.transmission)
    np.testing.assert_allclose(power, WEIGHT, rtol=1e-12)


def test_joining_faces_is_associative_and_nothing_is_nothing():
    first, second, third = (smooth(seed) for seed in (12, 13, 14))
    left, right = join(join(first, second), third), join(first, join(second, third))
    np.testing.assert_allclose(left, right, rtol=1e-14)
    assert join(first, None) is first
    below = add_diagonal(first, NOBODY)
    assert below.reflection is first[0]
    assert below.transmission is first[2]


def test_faces_joined_first_are_those_put_in_one_by_one():
    joined, one_by_one = together((join(FACE, PLATE), INK)), together((FACE, PLATE, INK))
    np.testing.assert_allclose(joined.reflection, one_by_one.reflection, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(joined.transmission, one_by_one.transmission, rtol=1e-12, atol=1e-15)


def test_a_rough_face_that_is_smooth_is_an_interface():
    above, below, through = FACE
    parts = [jnp.broadcast_to(jnp.diag(part), (ORDERS, N, N)) for part in (above, below, through, through)]
    as_rough = RoughElement(*parts, parts[0], parts[1], parts[2])
    for behind in ((), (PLATE,), (INK,), (FROSTED, INK)):
        found, expected = together((as_rough, *behind)), together((FACE, *behind))
        for one, other in zip(found[:2], expected[:2], strict=True):
            np.testing.assert_allclose(of_order_0(one), of_order_0(other), rtol=1e-12, atol=1e-14)


response = jax.jit(layer_response)


def ink_of(optical_thickness, albedo=0.95):
    """R and T of an ink that scatters isotropically, by the solver's own kernel."""
    scale = np.sqrt(WEIGHT**2 / (2 * MU))
    phase = albedo * np.outer(scale, scale) * np.ones((1, N, N))
    a_matrix, b_matrix = np.diag(1 / MU)[None] * np.ones((1, 1, 1)), np.diag(1 / MU)[None] - 2 * phase
    half = jnp.asarray(optical_thickness / 2)
    return response(jnp.asarray(a_matrix), jnp.asarray(b_matrix), half)


@pytest.mark.parametrize("share", [0.5, 0.1, 1e-6])
@pytest.mark.parametrize("optical_thickness", [0.01, 1.0, 30.0])
def test_two_parts_of_a_layer_are_the_layer(optical_thickness, share):
    parts = together((ink_of(share * optical_thickness), ink_of((1 - share) * optical_thickness)))
    reflection, transmission = ink_of(optical_thickness)
    np.testing.assert_allclose(parts.reflection, reflection, rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(parts.transmission, transmission, rtol=1e-9, atol=1e-13)


def test_light_trapped_without_loss_is_not_divided_by_zero():
    mirror = (jnp.ones(N), jnp.ones(N), jnp.zeros(N))
    found = join(mirror, mirror)
    np.testing.assert_array_equal(found, mirror)
    slope = jax.grad(lambda r: join((r, r, 1 - r), (r, r, 1 - r))[0].sum())(jnp.ones(N))
    assert np.all(np.isfinite(slope))


def with_ways(elements, ways, damping):
    pile = StackAssembly(NOBODY, damping)
    for element, way in zip(reversed(elements), reversed(ways), strict=True):
        pile = (
            pile.with_diagonal(element, way)
            if len(element) == 3
            else pile.with_layer(*element, jnp.ones(N) * 0.3)
        )
    return pile.closed(is_front=True)


def test_ways_that_are_not_damped_do_not_matter():
    elements = (FACE, PLATE, INK, FACE)
    ways = [jnp.zeros(N), jnp.full(N, 2.0), None, jnp.zeros(N)]
    pile = with_ways(elements, ways, lambda way: jnp.ones(N))
    # What face and plate reflect in front of the ink is left out.
    above, under, through = join(FACE, PLATE)
    reflection, transmission = between_elements(elements)
    for part, expected in zip(pile.below[:2], (reflection - np.diag(above), transmission), strict=True):
        np.testing.assert_allclose(of_order_0(part), expected, rtol=1e-11, atol=1e-14)
    # Regular light is followed beside: faces, and the share that the ink lets through.
    through_ink = (jnp.zeros(N), jnp.zeros(N), jnp.full(N, 0.3))
    beyond = join(through_ink, FACE)
    np.testing.assert_allclose(pile.regular, join((jnp.zeros(N), under, through), beyond), rtol=1e-12)


def test_light_between_two_faces_is_damped_by_its_way_to_and_fro():
    # Weak reflections: only the first way to and fro counts, 2 for light from above.
    weak = tuple(jnp.full(N, value) for value in (1e-4, 2e-4, 0.9))
    first, second = jnp.full(N, 0.4), jnp.full(N, 1.5)
    pile = StackAssembly(NOBODY, lambda w: jnp.exp(-w)).with_diagonal(weak, first).with_diagonal(weak, second)
    above, under, through = pile.run
    # From either side the light goes through the element that it meets first, and back.
    np.testing.assert_allclose(above, weak[0] + weak[2] ** 2 * np.exp(-2 * second) * weak[0], rtol=1e-6)
    np.testing.assert_allclose(under, weak[1] + weak[2] ** 2 * np.exp(-2 * first) * weak[1], rtol=1e-6)
    np.testing.assert_allclose(through, weak[2] ** 2, rtol=1e-6)
    np.testing.assert_allclose(pile.way, first + second, rtol=1e-14)


def test_clear_elements_alone_are_no_whole_stack():
    with pytest.raises(InputRefusedError, match="no layer of the stack scatters"):
        StackAssembly(NOBODY).with_diagonal(FACE).whole()


def test_light_that_a_layer_sends_through_a_plate_is_damped_unless_the_plate_is_in_front():
    way = jnp.full(N, 0.7)
    ink = add_layer(*INK, NOBODY)
    pile = StackAssembly(
        ink, lambda w: jnp.exp(-w), regular=(jnp.zeros(N), jnp.zeros(N), jnp.ones(N))
    ).with_diagonal(PLATE, way)
    above, under, through = PLATE
    for is_front, damping in ((True, 1.0), (False, np.exp(-0.7))):
        reflected = jnp.zeros(N) if is_front else above
        expected = add_diagonal((reflected, under, through * damping), ink)
        found = pile.closed(is_front).below
        np.testing.assert_allclose(found.reflection, expected.reflection, rtol=1e-12)
        np.testing.assert_allclose(found.transmission, expected.transmission, rtol=1e-12)

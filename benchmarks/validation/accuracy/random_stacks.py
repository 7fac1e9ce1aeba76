"""Random stacks, extreme ones included: energy, reciprocity, signs, and both derivatives against differences.

python -m benchmarks.validation.accuracy.random_stacks [NUMBER OF STACKS]
"""

import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from jaxink import (
    ClearLayer,
    Directions,
    ScatteringLayer,
    SolverConfig,
    Stack,
    diffuse_bsdf,
    hemispherical_power,
    plan_channels,
)
from jaxink.numerics.compiling import jit_unoptimised
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.plan import ChannelPlan

jax.config.update("jax_enable_x64", True)

RESULTS = Path(__file__).with_name("random_stacks.json")
# Scattering (s) and clear (c) layers, from the illuminated side on, and how many stacks of 20,000 have them.
STRUCTURES = {
    "s": 4000,
    "cs": 4000,
    "sc": 3000,
    "ss": 3000,
    "csc": 2000,
    "scs": 1500,
    "cscs": 1000,
    "sssss": 600,
    "cscscs": 500,
    "cscscscs": 400,
}
CONFIG = SolverConfig(12, 8, 8, 3)
# BSDF in 1/sr below which rounding, 1e-15 or so, is compared with this value instead.
DIM = 1e-8
# The same of the sum of all directions, of which the derivatives are taken.
DARK = 1e-3
DERIVATIVES_OF_EVERY = 10
# BSDF in 1/sr of directions that count for the derivatives.
LEAST = 1e-6
POLAR = (0.0, 5.0, 37.0, 60.0, 85.0, 89.5)
# Narrower backward peaks are refused by `choose_sizes`.
MOST_BACKWARD = 0.97
# One-sided difference of sixth order, in units of each number's distance to where it ends.
STEP, COEFFICIENTS = 1e-2, np.array([-147, 360, -450, 400, -225, 72, -10]) / 60


def _directions() -> Directions:
    """All pairs of `POLAR` in reflection and then in transmission, each with an azimuth."""
    into, out = (x.ravel() for x in np.meshgrid(POLAR, POLAR, indexing="ij"))
    azimuth = 180.0 * np.abs(np.cos(into + out))
    twice = [np.tile(x, 2) for x in (into, out, azimuth)]
    return Directions.from_degrees(*twice, np.repeat([False, True], into.size))


DIRECTIONS = _directions()


def stack_of(structure: str, numbers: jax.Array) -> Stack:
    """Stack of a row of numbers, see `drawn`."""
    *layers, ends = jnp.reshape(numbers, (len(structure) + 1, 4))
    return Stack(
        tuple(
            ScatteringLayer(index, jnp.exp(thickness), albedo, HenyeyGreenstein(asymmetry))
            if kind == "s"
            else ClearLayer(index, jnp.exp(thickness))
            for kind, (index, thickness, albedo, asymmetry) in zip(structure, layers, strict=True)
        ),
        ends[0],
        ends[1],
    )


def drawn(structure: str, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of a stack, a row (index, log of the optical thickness, albedo, g) a layer, and of a direction.

    Along the direction each number moves by a share of its distance to where it ends; indices do not move, as
    total reflection would begin or end at some direction.
    """
    rows, along = [], []
    conservative = random.random() < 0.3
    for kind in structure:
        index = 1 + 10 ** random.uniform(-4, 0) if random.random() < 0.5 else random.uniform(1.3, 2.0)
        thickness = 10 ** random.uniform(-6, 4) if kind == "s" else 10 ** random.uniform(-4, 2)
        albedo = random.choice([0.0, 1.0, random.uniform(), 1 - 10 ** random.uniform(-8, 0)])
        asymmetry = max(random.choice([-1, 1]) * (1 - 10 ** random.uniform(-3, 0)), -MOST_BACKWARD)
        if conservative:
            albedo, thickness = 1.0, thickness if kind == "s" else 0.0
        # In a thick layer an absorption of 1 / thickness^2 already matters, and one of 1 - g in a thin one.
        scale = min(0.1, 1 / (1 + thickness**2), 1 - abs(asymmetry)) * (albedo if albedo > 0.5 else 1.0)
        rows.append([index, np.log(max(thickness, 1e-30)), albedo, asymmetry])
        inward = -scale if albedo > 0.5 else scale
        along.append([0.0, 0.1, 0.0 if conservative else inward, 0.1 * (1 - abs(asymmetry))])
    front, back = (1.0 if random.random() < 0.7 else random.uniform(1.0, 2.0) for _ in range(2))
    rows.append([front, back, 0.0, 0.0])
    along.append([0.0] * 4)
    return np.array(rows).ravel(), np.array(along).ravel()


def _difference(one, other):
    """Largest difference of two matrices over their largest element."""
    return jnp.max(jnp.abs(one - other)) / jnp.maximum(jnp.max(one), DIM)


def _checks(structure: str, plan: ChannelPlan, numbers):
    """What is right or wrong of one stack: see `_faults`."""
    stack = stack_of(structure, numbers)
    mirrored = Stack(stack.layers[::-1], stack.index_back, stack.index_front)
    n, m = len(POLAR), DIRECTIONS.incidence.size // 2
    pairs = np.arange(m).reshape(n, n)
    bsdf = diffuse_bsdf(stack, DIRECTIONS, CONFIG, plan)
    behind = diffuse_bsdf(mirrored, DIRECTIONS, CONFIG, plan.reversed(len(structure)))
    reflected, through, back = bsdf[:m][pairs], bsdf[m:][pairs], behind[m:][pairs]
    # Radiance over n^2: from front to back as from back to front.
    through, back = through / stack.index_back**2, back / stack.index_front**2
    grid = plan.grid(stack, CONFIG)
    sines = grid.kappa[: CONFIG.nodes_escaping] / stack.index_front
    powers = hemispherical_power(stack, sines, CONFIG, plan)
    return {
        "bsdf": bsdf,
        "reciprocity of reflection": _difference(reflected, reflected.T),
        "reciprocity of transmission": _difference(through, back.T),
        "power": sum(powers),
    }


def _derivatives(structure: str, plan: ChannelPlan, numbers, along):
    """Errors of both derivatives of the sum of the BSDF against differences."""
    bsdf = diffuse_bsdf(stack_of(structure, numbers), DIRECTIONS, CONFIG, plan)
    weights = jnp.asarray(np.random.default_rng(1).uniform(0.5, 1, bsdf.size))
    # Where a peak that the streams do not resolve makes the sum negative, the BSDF is 0, though not smoothly.
    further = diffuse_bsdf(stack_of(structure, numbers + 6 * STEP * along), DIRECTIONS, CONFIG, plan)
    weights = jnp.where(jnp.minimum(bsdf, further) > LEAST, weights, 0.0)
    scale = jnp.maximum(jnp.sum(weights * further), DARK)

    def value(x):
        return jnp.sum(weights * diffuse_bsdf(stack_of(structure, x), DIRECTIONS, CONFIG, plan)) / scale

    def slope(x):
        return jax.jvp(value, (x,), (along,))

    values, slopes = jax.lax.map(lambda k: slope(numbers + k * STEP * along), jnp.arange(7.0))
    _, curvature = jax.jvp(lambda x: slope(x)[1], (numbers,), (along,))
    expected = COEFFICIENTS @ values / STEP, COEFFICIENTS @ slopes / STEP
    return {
        "first derivative": jnp.abs(slopes[0] - expected[0]) / (1 + jnp.abs(slopes[0])),
        "second derivative": jnp.abs(curvature - expected[1]) / (1 + jnp.abs(curvature)),
    }


def _faults(structure: str, numbers: np.ndarray, found: dict) -> dict[str, np.ndarray]:
    """Size of each fault of the stacks, for each stack."""
    layers = numbers.reshape(len(numbers), len(structure) + 1, 4)[:, :-1]
    conservative = np.all(
        [layers[:, k, 2] == 1 if kind == "s" else layers[:, k, 1] < -60 for k, kind in enumerate(structure)],
        axis=0,
    )
    excess = np.max(found["power"] - 1, axis=1)
    return {
        "not finite": sum(~np.isfinite(x).reshape(len(x), -1).all(axis=1) for x in found.values()),
        "negative bsdf": -np.minimum(found["bsdf"].min(axis=1), 0.0),
        "energy": np.where(conservative, np.max(np.abs(found["power"] - 1), axis=1), np.maximum(excess, 0.0)),
        **{name: found[name] for name in found if "reciprocity" in name},
    }


def examined(structure: str, n_stacks: int, seed: int) -> dict[str, np.ndarray]:
    """Faults of random stacks of one structure."""
    random = np.random.default_rng([seed, len(structure), *map(ord, structure)])
    draws = [drawn(structure, random) for _ in range(n_stacks)]
    numbers, along = (np.array(part) for part in zip(*draws, strict=True))
    plan = plan_channels(stack_of(structure, numbers[0]), range(len(structure) + 2))
    faults = _faults(structure, numbers, _of_each(jax.jit(partial(_checks, structure, plan)), numbers))
    some = slice(None, None, DERIVATIVES_OF_EVERY)
    derivatives = _of_each(
        jit_unoptimised(partial(_derivatives, structure, plan)), numbers[some], along[some]
    )
    return faults | derivatives | {"numbers": numbers}


def _of_each(function: Callable, *columns: np.ndarray) -> dict[str, np.ndarray]:
    """Results of a function for each row."""
    rows = zip(*map(jnp.asarray, columns), strict=True)
    found = [jax.tree.map(np.asarray, function(*row)) for row in rows]
    return {name: np.array([one[name] for one in found]) for name in found[0]}


def main(n_stacks: int) -> None:
    """Examine stacks of all structures, unless that was done before, and keep the largest of each fault."""
    kept = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for structure, share in STRUCTURES.items():
        each = -(-n_stacks * share // 20_000)
        if kept.get(structure, {}).get("stacks", 0) >= each:
            continue
        faults = examined(structure, each, 0)
        numbers = faults.pop("numbers")
        kept[structure] = {"stacks": each} | {name: float(np.max(fault)) for name, fault in faults.items()}
        print(structure, kept[structure], flush=True)
        for name, fault in faults.items():
            if not fault.max() < 1e-6:
                worst = np.argmax(fault) * (DERIVATIVES_OF_EVERY if "derivative" in name else 1)
                print("   ", name, (~(fault < 1e-6)).sum(), numbers[worst].tolist(), flush=True)
        RESULTS.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20_000)

"""How the solver's time and memory grow, and what compiling costs: docs/validation/performance.md.

python -m benchmarks.speed.solver

Runs on JAX's default device. The text of the page is in benchmarks/speed/solver.md.in.
"""

import json
import math
import statistics
import subprocess
import sys
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.pages import filled, machine, section_after, table, write_page
from jaxink import Directions, ScatteringLayer, SolverConfig, Stack, diffuse_bsdf
from jaxink.numerics.precision import computing
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.layer_response import layer_response

jax.config.update("jax_enable_x64", True)

TEMPLATE = Path(__file__).with_name("solver.md.in")
PAGE = "performance.md"
# What benchmarks.speed.accelerator writes at the end of the page.
ACCELERATOR = "made by python -m benchmarks.speed.accelerator"
ROUNDS = 9
W2 = (0.85, 0.999, 40.0)
W2_SIZES = SolverConfig(24, 12, 48, 16)
OUTGOING = [*np.arange(0.0, 88.0, 2.5), 89.0]


def directions(incidences) -> Directions:
    """37 angles, two azimuths and both sides at each incidence: 740 points for W2's five."""
    axes = np.meshgrid(incidences, OUTGOING, [0.0, 180.0], [0, 1], indexing="ij")
    theta_i, theta_o, phi, side = (axis.ravel() for axis in axes)
    return Directions.from_degrees(theta_i, theta_o, phi, side > 0)


FIVE = directions([0.0, 15.0, 30.0, 45.0, 60.0])


def matched(parameters, points=FIVE, config=W2_SIZES):
    """BSDF of a layer without an index step, as a function of g, albedo and thickness."""
    asymmetry, albedo, thickness = parameters
    layer = ScatteringLayer(1.0, thickness, albedo, HenyeyGreenstein(asymmetry))
    return diffuse_bsdf(Stack((layer,), 1.0, 1.0), points, config)


def layered(parameters, n_layers):
    """BSDF of several layers of one ink, of index 1.5 in air."""
    asymmetry, albedo, thickness = parameters
    layer = ScatteringLayer(1.5, thickness / n_layers, albedo, HenyeyGreenstein(asymmetry))
    stack = Stack((layer,) * n_layers, 1.0, 1.0)
    return diffuse_bsdf(stack, FIVE, SolverConfig(12, 14, 40, 16))


def milliseconds(function, argument) -> float:
    """Median time of a warm call."""
    compiled = jax.jit(function)

    def call():
        jax.block_until_ready(compiled(argument))

    call()
    return median_ms(call)


def median_ms(call, most_s: float = math.inf) -> float:
    """Median time of calls; after ``most_s`` seconds, no further one begins."""
    times: list[float] = []
    while len(times) < ROUNDS and sum(times) < most_s:
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return 1e3 * statistics.median(times)


def growth(numbers, times) -> str:
    """Exponent of the growth over the last half of the range."""
    middle = len(numbers) // 2
    return f"{np.log(times[-1] / times[middle]) / np.log(numbers[-1] / numbers[middle]):.2f}"


def series(name, numbers, function_of, argument_of=lambda _: jnp.array(W2)) -> list[str]:
    """Row of times along one size."""
    times = [milliseconds(function_of(n), argument_of(n)) for n in numbers]
    cells = ", ".join(f"{n}: {t:.2f}" for n, t in zip(numbers, times, strict=True))
    return [name, cells, growth(numbers, times)]


def spectra(count):
    """Optical parameters of several wavelengths."""
    steps = np.linspace(0, 1, count)
    return jnp.asarray(np.column_stack([0.85 - 0.1 * steps, 0.999 - 0.1 * steps, 40 - 20 * steps]))


def scaling() -> str:
    """Table of times along every size."""
    rows = [
        series(
            "incidences", [1, 5, 25, 100], lambda n: lambda p: matched(p, directions(np.linspace(0, 80, n)))
        ),
        series("wavelengths", [1, 4, 16, 41], lambda _: jax.vmap(matched), spectra),
        series(
            "nodes (streams / 2), moments twice as many",
            [8, 16, 24, 32, 48, 64],
            lambda n: lambda p: matched(p, config=SolverConfig(n, 12, 2 * n, 16)),
        ),
        series(
            "azimuthal orders",
            [1, 4, 8, 16, 32],
            lambda n: lambda p: matched(p, config=SolverConfig(24, 12, 48, n)),
        ),
        series("scattering layers, film", [1, 2, 4, 8], lambda n: lambda p: layered(p, n)),
    ]
    return table(["size", "number: median, ms", "exponent"], rows)


def derivatives() -> str:
    """Table of the value, its Jacobian and the layer methods."""
    rows = []
    for method in ("discrete_ordinates", "adding_doubling"):
        config = SolverConfig(24, 12, 48, 16, method)

        def value(p, config=config):
            return matched(p, config=config)

        forward, jacobian = (milliseconds(f, jnp.array(W2)) for f in (value, jax.jacfwd(value)))
        rows.append([method, f"{forward:.2f}", f"{jacobian:.2f}", f"{jacobian / forward:.1f}"])
    return table(["layer method", "value, ms", "Jacobian in 3 parameters, ms", "ratio"], rows)


def arithmetic() -> str:
    """Time of the eigenproblems alone, as LAPACK does them, and share of the whole."""
    random = np.random.default_rng(0)
    matrices = random.normal(size=(16, 24, 24))
    matrices = jnp.asarray(matrices + matrices.swapaxes(1, 2))
    eigen = milliseconds(lambda m: jnp.linalg.eigh(m, symmetrize_input=False), matrices)
    product = milliseconds(lambda m: m @ m, matrices)
    positive = matrices @ matrices + 24 * jnp.eye(24)
    layer = milliseconds(lambda m: layer_response(m, m, 20.0), positive)
    whole = milliseconds(matched, jnp.array(W2))
    return (
        f"W2 takes {whole:.2f} ms. The response of the layer, 16 matrices of 24 rows, takes {layer:.2f} ms\n"
        f"of it, and the eigenproblems in there {eigen:.2f} ms, as LAPACK does them; one product of all\n"
        f"these matrices takes {product:.3f} ms. The rest is phase matrices, inverses, interpolation to 740\n"
        "directions and the call itself."
    )


# Function and number of wavelengths.
CHILD_TASKS = {
    "nothing but the imports": (jnp.sum, 1),
    "value, W2": (jax.vmap(matched), 1),
    "Jacobian, W2": (jax.vmap(jax.jacfwd(matched)), 1),
    "value, 41 wavelengths": (jax.vmap(matched), 41),
    "Jacobian, 41 wavelengths": (jax.vmap(jax.jacfwd(matched)), 41),
}
EXAMPLE = "fit of the embedded example"


def peak_memory_mib() -> float:
    """Largest resident memory of this process so far, where the system tells it."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return float("nan")
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024


def fit_example():
    """Fit of the embedded simulated measurement, gradient."""
    import jaxink
    from jaxink.data import simulated_example

    return jaxink.fit(*map(str, simulated_example()), jaxink.FitOptions(profile="none"))


def child(name: str) -> None:
    """First and second call of a task in this fresh process, and the memory it took."""
    if name == EXAMPLE:
        task = fit_example
    else:
        function, n_wavelengths = CHILD_TASKS[name]
        compiled, argument = jax.jit(function), spectra(n_wavelengths)

        def task():
            return compiled(argument)

    seconds = []
    with computing():
        for _ in range(2):
            begin = time.perf_counter()
            jax.block_until_ready(task())
            seconds.append(time.perf_counter() - begin)
    print(json.dumps({"seconds": seconds, "memory_mib": peak_memory_mib()}))


def fresh() -> str:
    """Table of first calls and peak memory, each in a process of its own."""
    rows = []
    for name in [*CHILD_TASKS, EXAMPLE]:
        command = [sys.executable, "-m", "benchmarks.speed.solver", "--child", name]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        found = json.loads(done.stdout.splitlines()[-1])
        first, second = found["seconds"]
        rows.append([name, f"{first:.2f}", f"{second:.3f}", f"{found['memory_mib']:.0f}"])
    return table(["task", "first call, s (traces, compiles)", "second call, s", "peak memory, MiB"], rows)


def main() -> None:
    """Write docs/validation/performance.md."""
    if len(sys.argv) == 3 and sys.argv[1] == "--child":
        child(sys.argv[2])
        return
    with computing():
        parts = {"derivatives": derivatives(), "scaling": scaling(), "arithmetic": arithmetic()}
    parts |= {"fresh": fresh(), "machine": machine()}
    write_page(PAGE, filled(TEMPLATE, **parts) + section_after(PAGE, ACCELERATOR))


if __name__ == "__main__":
    main()

"""Programs that hang on a jaxlib with the deadlock; each runs in a fresh process.

    python programs.py fit|threads|devices [CORE,CORE...]

The layer has 24 channels and 32 azimuthal orders, enough work for such a jaxlib to split its LAPACK calls.
The environment variable JAXINK_TEST_ANY_JAXLIB lets the programs run on a version that jaxink refuses.
"""

import os
import sys
import threading

if len(sys.argv) > 2:
    os.sched_setaffinity(0, {int(core) for core in sys.argv[2].split(",")})
if "devices" in sys.argv:
    os.environ["XLA_FLAGS"] = "--xla_force_host_platform_device_count=2"

import jax
import jax.numpy as jnp
import numpy as np

import jaxink.numerics.precision as precision

if os.environ.get("JAXINK_TEST_ANY_JAXLIB"):
    precision.require_safe_jaxlib = lambda: None

from jaxink import Directions, ScatteringLayer, SolverConfig, Stack, diffuse_bsdf
from jaxink.particles.phase_function import HenyeyGreenstein

# A fit enters 64 bits by itself.
jax.config.update("jax_enable_x64", sys.argv[1] != "fit")

REPEATS = 20
CONFIG = SolverConfig(24, 12, 48, 32)
DIRECTIONS = Directions.from_degrees(
    [0.0, 30.0, 30.0], [20.0, 40.0, 40.0], [0.0, 180.0, 90.0], [False, True, True]
)


def jacobian():
    """A compiled Jacobian of the BSDF in three parameters."""

    def bsdf(x):
        layer = ScatteringLayer(1.0, x[0], x[1], HenyeyGreenstein(x[2]))
        stack = Stack((layer,), 1.0, 1.0)
        return diffuse_bsdf(stack, DIRECTIONS, CONFIG)

    return jax.jit(jax.jacfwd(bsdf))


def run_jacobian(device=None):
    """Call it over and over."""
    x = jnp.array([5.0, 0.99, 0.6])
    x = jax.device_put(x, device) if device is not None else x
    compiled = jacobian()
    for _ in range(REPEATS):
        compiled(x).block_until_ready()


def run_fit():
    """A whole fit of a noise-free curve, from another start."""
    import jaxink

    sample = jaxink.parse_sample(
        """
        schema_version = 1
        [[layers]]
        name = "ink"
        kind = "scattering"
        phase_function = "henyey_greenstein"
        refractive_index = 1.5
        thickness_um = 50
        scattering_per_mm = { free = true, min = 1, max = 1000, value = 60 }
        absorption_per_mm = { free = true, min = 0, max = 50, value = 2 }
        asymmetry_parameter = { free = true, min = -0.9, max = 0.95, value = 0.5 }
        [noise]
        relative = 0.01
        """
    )
    theta = np.tile(np.arange(5.0, 80.0, 5.0), 2)
    n = theta.size
    at = (np.full(n, 20.0), theta, np.full(n, 90.0), np.full(n, 550.0), np.arange(n) < n // 2)
    data = jaxink.GonioData(*at, np.ones(n))
    data = data.replace(bsdf_per_sr=jaxink.predict(sample, data, CONFIG))
    table = sample.parameters.replace("ink.scattering_per_mm", value=90.0)
    start = jaxink.Sample(sample.layers, table, noise=sample.noise)
    result = jaxink.fit(data, start, jaxink.FitOptions(config=CONFIG, profile="none"))
    assert abs(result["ink.scattering_per_mm"].value - 60) < 0.1, result["ink.scattering_per_mm"]


def side_by_side(functions):
    """Run functions in threads of their own."""
    threads = [threading.Thread(target=function) for function in functions]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def main():
    """Run the program that is named."""
    name = sys.argv[1]
    if name == "fit":
        run_fit()
    elif name == "threads":
        side_by_side([run_jacobian, run_jacobian])
    else:
        assert len(jax.devices()) == 2
        side_by_side([lambda d=d: run_jacobian(d) for d in jax.devices()])
    sys.stdout.write("done\n")


if __name__ == "__main__":
    main()

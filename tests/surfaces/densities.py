"""Densities of slopes that tests state by their variance."""

import jax.numpy as jnp

from jaxink.surfaces.slopes import LAWS, AnalyticSlopes


def gaussian_slopes(slope_variance) -> AnalyticSlopes:
    """Gaussian density (Beckmann) of a variance along each axis."""
    return AnalyticSlopes(jnp.asarray(slope_variance), LAWS["beckmann"])

"""The posterior by sampling: chains that mix, about the fit."""

import numpy as np
import pytest


@pytest.mark.slow
def test_posterior_mixes(run):
    pytest.importorskip("numpyro")
    names = run("posterior")
    chains = np.asarray(names["samples"]["ink.scattering_per_mm"])
    assert chains.shape == (2, 300)
    assert abs(chains.mean() - names["result"]["ink.scattering_per_mm"].value) < 0.5 * chains.std()

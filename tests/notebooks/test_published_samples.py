"""The stand-ins of the published samples: both models fit, and one scan does not determine the ink."""

import pytest


@pytest.mark.slow
def test_published_samples(run):
    names = run("published_samples")
    rms_percent = names["rms_percent"]
    for model in ("Mie", "HG"):
        everything, normal = (names["fits"][model, p] for p in ("everything", "T at 0 deg"))
        assert rms_percent(normal, "R") > 2 * rms_percent(everything, "R")
    assert names["rough"].converged
    assert names["coloured"].converged

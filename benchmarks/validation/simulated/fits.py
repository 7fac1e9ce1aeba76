"""Fits of simulated measurements from what their declared files say."""

import re

import jaxink
from benchmarks.simulated_data import data_file, declared_text
from jaxink.fitting import FitResult

# The angle of a rough face is fitted, too; start and range have nothing to do with the truth.
FREE_SIGMA = "sigma_deg = { free = true, value = 6, min = 0.5, max = 25 }"


def fit_text(name: str, text: str, method: str = "gradient") -> FitResult:
    """Fit one simulated measurement with the text of a sample file."""
    sample = jaxink.parse_sample(text, name)
    return jaxink.fit(data_file(name), sample, jaxink.FitOptions(method=method))


def text_of(name: str) -> str:
    """Sample file of a simulated measurement, with the angle of a rough face free."""
    return re.sub(r"sigma_deg = [0-9.]+", FREE_SIGMA, declared_text(name))


def fit_declared(name: str, method: str = "gradient") -> FitResult:
    """Fit one simulated measurement from what its declared file says."""
    return fit_text(name, text_of(name), method)

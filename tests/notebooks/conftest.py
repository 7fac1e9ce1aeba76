"""Notebooks run as users run them: at their own accuracy, and free to switch 64 bits on for good."""

import runpy
from pathlib import Path

import pytest

NOTEBOOKS = Path(__file__).resolve().parents[2] / "notebooks"


@pytest.fixture
def run(monkeypatch):
    """Runs a notebook by its name; what it leaves behind, by name."""
    import jax
    import matplotlib.pyplot as plt

    monkeypatch.setenv("MPLBACKEND", "Agg")
    plt.switch_backend("Agg")
    yield lambda name: runpy.run_path(str(NOTEBOOKS / f"{name}.py"))
    plt.close("all")
    jax.config.update("jax_enable_x64", False)

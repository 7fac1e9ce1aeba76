# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Gradient against simplex
#
# Published reconstructions of inks minimise by the Nelder-Mead simplex, which needs no derivatives. jaxink's
# forward model is differentiable, and a step by the exact Jacobian knows where the valley leads. Here both
# minimise the same compiled chi-square within the same bounds from the same starts, and their paths are drawn
# as they go.
#
# The measurements are **simulated** by an independent Monte Carlo program. Needs the file in
# `notebooks/data`. Takes about 70 s on two cores, most of it compilation.

# %%
import dataclasses
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import jaxink
from jaxink.data import simulated_example

here = Path(__file__).parent if "__file__" in globals() else Path()
data_folder = next(f for f in (here / "data", here / "notebooks" / "data") if f.is_dir())


class Follower:
    """Follows a fit: loss after each step of each of its searches, and the seconds since the first."""

    def __init__(self):
        self.steps = {}

    def __call__(self, task, _, loss):
        """Be called by the fit after each step."""
        self.steps.setdefault(task, []).append((time.perf_counter(), loss))

    def first_search(self):
        """Seconds and loss of the first search after a scan, if there is one."""
        seconds, loss = np.array(next(steps for task, steps in self.steps.items() if task != "scan")).T
        return seconds - seconds[0], loss


def followed(data, sample, method, **options):
    """A fit and its path."""
    path = Follower()
    chosen = jaxink.FitOptions(method=method, accuracy=1e-3, profile="none", **options)
    return jaxink.fit(data, sample, chosen, path), path


# %% [markdown]
# ## Three parameters: scattering, absorption, asymmetry parameter
#
# Four starts: the middle of the ranges, and three others. Compilation is left out of the seconds.

# %%
STARTS = ((31.6, 0.1, 0.0), (300.0, 10.0, -0.5), (5.0, 0.01, 0.8), (800.0, 0.5, 0.3))
data_file, sample_file = simulated_example()
data, sample = jaxink.read(data_file), jaxink.load_sample(sample_file)
fits = {"gradient": [], "simplex": []}
for method, results in fits.items():
    for values in STARTS:
        table = sample.parameters
        for parameter, value in zip(table.free, values, strict=True):
            table = table.replace(parameter.name, value=value)
        results.append(followed(data, dataclasses.replace(sample, parameters=table), method))

# %%
best = min(result.merit.chi_square for results in fits.values() for result, _ in results)
figure, (left, right) = plt.subplots(1, 2, figsize=(8.5, 3.6), sharey=True, layout="constrained")
for method, colour in (("gradient", "C0"), ("simplex", "C3")):
    for number, (_, path) in enumerate(fits[method]):
        seconds, loss = path.first_search()
        above = np.maximum(loss - best, 1e-4)
        label = method if number == 0 else None
        left.plot(
            np.arange(1, len(loss) + 1), above, ".-", color=colour, linewidth=0.8, markersize=3, label=label
        )
        right.plot(seconds, above, ".-", color=colour, linewidth=0.8, markersize=3)
left.set(xscale="log", yscale="log", xlabel="step", ylabel="chi-square above the minimum")
right.set(xlabel="seconds")
left.axhline(1, color="0.7", linewidth=0.8)
_ = left.legend(frameon=False)

# %% [markdown]
# Below the grey line a fit is within one standard error of the minimum. Each of the last steps of the
# gradient method gains several powers of ten; the simplex gains one in ten to twenty steps.

# %%
print(f"{'start':>24s}{'':4s}{'gradient':>26s}{'simplex':>26s}")
for values, (gradient, _), (simplex, _) in zip(STARTS, fits["gradient"], fits["simplex"], strict=True):
    cells = []
    for result in (gradient, simplex):
        search = result.searches[0]
        cells.append(f"{search.jacobians + search.evaluations:5d} calls, chi2 {result.merit.chi_square:9.2f}")
    print(f"{values!s:>24s}{'':4s}{cells[0]:>26s}{cells[1]:>26s}")

# %%
for gradient, _ in fits["gradient"]:
    assert gradient.converged
    assert gradient.merit.chi_square < best + 1e-2
    assert gradient["ink.scattering_per_mm"].standard_error > 0
calls = {
    method: np.mean([result.searches[0].jacobians + result.searches[0].evaluations for result, _ in results])
    for method, results in fits.items()
}
print(f"calls of the model in the mean: gradient {calls['gradient']:.0f}, simplex {calls['simplex']:.0f}")
assert calls["simplex"] > 5 * calls["gradient"]

# %% [markdown]
# A call with its Jacobian costs two to three times as much as one without; the right panel has the balance in
# seconds. Only the gradient method has standard errors, since they are made of the same Jacobian.
#
# ## Four parameters of Mie spheres: many minima
#
# The misfit of spheres has many minima along the radius. The gradient method first scans that range; the
# simplex takes the valley that it happens to start in.

# %%
MIE = """
schema_version = 1
title = "Simulated: white ink of Mie spheres"
wavelength_nm = 550

[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1.0

[[layers]]
name = "ink"
kind = "scattering"
refractive_index = 1.5
thickness_um = 63
phase_function = "mie"
radius_nm = { free = true, min = 100, max = 600 }
volume_fraction = { free = true, min = 0.002, max = 0.5 }
particle_index = { free = true, min = 1.6, max = 2.8 }
particle_absorption_index = { free = true, min = 0, max = 0.01 }

[noise]
scan_relative = 0.002
"""
white, sample = jaxink.read(data_folder / "simulated_white_ink_mie.csv"), jaxink.parse_sample(MIE)
gradient, path = followed(white, sample, "gradient")
simplex, simplex_path = followed(white, sample, "simplex", scan=False)

# %%
began = path.steps["scan"][0][0]
figure, axes = plt.subplots(figsize=(6.5, 3.8), layout="constrained")
for task, steps in path.steps.items():
    seconds, loss = np.array(steps).T
    style, label = (
        ("x", "gradient, ends of the scan") if task == "scan" else (".-", "gradient, final searches")
    )
    axes.plot(
        seconds - began, loss, style, color="C0", label=None if task in ("start 2", "start 3") else label
    )
seconds, loss = simplex_path.first_search()
axes.plot(seconds, loss, color="C3", label="simplex")
axes.axhline(gradient.merit.degrees_of_freedom, color="0.7", linewidth=0.8, label="degrees of freedom")
axes.set(yscale="log", xlabel="seconds, without compilation before the first step", ylabel="chi-square")
_ = axes.legend(frameon=False, fontsize=8)

# %% [markdown]
# At each cross the radius is held and the other three parameters are fitted, up the range and down again. The
# lowest minima along it are then searched to the end. The simplex is quicker and reports that it converged:
# to a chi-square fifty times too large, at bounds.

# %%
for label, result in (("gradient", gradient), ("simplex", simplex)):
    effort = sum(s.jacobians + s.evaluations for s in result.searches)
    print(f"{label}: {result.verdict.sentence}")
    radius_nm = result["ink.radius_nm"].value
    print(f"   radius {radius_nm:.1f} nm, truth 231; {effort} calls; {result.outcome.value}")

# %%
assert gradient.converged
assert gradient.verdict.reduced_chi_square < 1.2
assert gradient.merit.chi_square < simplex.merit.chi_square + 0.1
found = gradient["ink.radius_nm"]
assert abs(found.value - 231) < 3 * found.standard_error

# %% [markdown]
# [A page](../docs/gradient-and-simplex.md) has the comparison with all points and many repetitions.

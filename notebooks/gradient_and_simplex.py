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
# minimise the same compiled chi-square within the same bounds from the same starts. A result keeps the path
# of each search: evaluations, seconds, loss and parameters. The figures are drawn from these paths.
#
# The measurements are **simulated** by an independent Monte Carlo program. Needs the file in
# `notebooks/data`. Takes about 40 s of processor time, most of it compilation.

# %%
import dataclasses
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import jaxink
import jaxink.plots
from jaxink.data import simulated_example

here = Path(__file__).parent if "__file__" in globals() else Path()
data_folder = next(f for f in (here / "data", here / "notebooks" / "data") if f.is_dir())


def fit(data, sample, method, progress=None, **options):
    """A fit without the profiles that would follow the search."""
    chosen = jaxink.FitOptions(method=method, accuracy=1e-3, profile="none", **options)
    return jaxink.fit(data, sample, chosen, progress)


def calls(result):
    """Evaluations and Jacobians of all searches, the scan included."""
    return sum(search.jacobians + search.evaluations for search in result.searches)


# %% [markdown]
# ## Three parameters: scattering, absorption, asymmetry parameter
#
# Four starts, far from each other and from the minimum.

# %%
STARTS = ((31.6, 0.1, 0.0), (300.0, 10.0, -0.5), (5.0, 0.01, 0.8), (800.0, 0.5, 0.3))
data_file, sample_file = simulated_example()
data, sample = jaxink.read(data_file), jaxink.load_sample(sample_file)
starts = []
for values in STARTS:
    table = sample.parameters
    for parameter, value in zip(table.free, values, strict=True):
        table = table.replace(parameter.name, value=value)
    starts.append(dataclasses.replace(sample, parameters=table))
fits = {method: [fit(data, start, method) for start in starts] for method in ("gradient", "simplex")}

# %%
print(f"{'start':>24s}{'gradient':>30s}{'simplex':>30s}")
for values, *results in zip(STARTS, *fits.values(), strict=True):
    cells = [f"{calls(result):5d} calls, chi2 {result.merit.chi_square:9.2f}" for result in results]
    print(f"{values!s:>24s}{cells[0]:>30s}{cells[1]:>30s}")

# %% [markdown]
# Both end in the same minimum from every start. On their way they first find the valley in which the reduced
# scattering mu_s (1 - g) is right (dashed), and then go along its floor, on which chi-square hardly changes.

# %%
figure, panels = plt.subplots(1, 2, figsize=(8.5, 3.6), sharey=True, layout="constrained")
scattering = np.geomspace(30, 1000, 100)
for panel, (method, results) in zip(panels, fits.items(), strict=True):
    panel.plot(scattering, 1 - 38 / scattering, "--", color="0.6")
    for result in results:
        way = result.searches[0].path.values
        panel.plot(
            way["ink.scattering_per_mm"], way["ink.asymmetry_parameter"], ".-", linewidth=0.8, markersize=4
        )
    panel.plot(95, 0.6, "k*", markersize=10, zorder=3)
    panel.set(xscale="log", ylim=(-0.9, 1), xlabel="scattering coefficient [1/mm]", title=method)
_ = panels[0].set_ylabel("asymmetry parameter g")

# %% [markdown]
# ## How fast
#
# The progress of one start, with two more of the methods that `FitOptions` takes by name. Compilation does
# not count. A call with its Jacobian costs two to three times as much as one without; the left panel has the
# balance in seconds.

# %%
others = {method: fit(data, starts[0], method) for method in ("l_bfgs_b", "trf")}
jaxink.plots.progress_figure({method: results[0] for method, results in fits.items()} | others)

# %%
best = min(result.merit.chi_square for results in fits.values() for result in results)
for gradient in fits["gradient"]:
    assert gradient.converged
    assert gradient.merit.chi_square < best + 1e-2
    assert gradient["ink.scattering_per_mm"].standard_error > 0
mean_calls = {method: np.mean([calls(result) for result in results]) for method, results in fits.items()}
print(f"calls in the mean: gradient {mean_calls['gradient']:.0f}, simplex {mean_calls['simplex']:.0f}")
assert mean_calls["simplex"] > 5 * mean_calls["gradient"]

# %% [markdown]
# ## Four parameters of Mie spheres: many minima
#
# The misfit of spheres has many minima along the radius. The gradient method first scans that range: the
# radius is held and the other three parameters are fitted, up the range and down again. The simplex takes the
# valley that it happens to start in, unless it is given the same scan.

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
white, spheres = jaxink.read(data_folder / "simulated_white_ink_mie.csv"), jaxink.parse_sample(MIE)
scanned = []


def follow(task, step, loss):
    """Keep the loss at each value of the scan."""
    if task == "scan":
        scanned.append((step, loss))


mie = {
    "gradient": fit(white, spheres, "gradient", follow),
    "simplex": fit(white, spheres, "simplex"),
    "simplex after the scan": fit(white, spheres, "simplex", scan=True),
}
jaxink.plots.progress_figure(mie)

# %%
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(*np.transpose(scanned), "x-", linewidth=0.6, label="fitted at a held radius")
axes.axhline(mie["gradient"].merit.degrees_of_freedom, color="0.7", label="degrees of freedom")
axes.axhline(mie["simplex"].merit.chi_square, color="C3", label="simplex without the scan")
axes.set(yscale="log", xlabel="value of the radius, up the range and down again", ylabel="chi-square")
_ = axes.legend(frameon=False, fontsize=8)

# %%
for label, result in mie.items():
    print(f"{label}, {calls(result)} calls: {result.verdict.sentence}")
    print(f"   radius {result['ink.radius_nm'].value:.1f} nm, truth 231")

# %% [markdown]
# Without the scan the simplex ends at bounds with a chi-square far too large, and its own test of convergence
# does not notice. Only the gradient method has standard errors, since they are made of the same Jacobian.

# %%
assert mie["gradient"].converged
assert mie["gradient"].verdict.reduced_chi_square < 1.2
assert mie["simplex"].verdict.reduced_chi_square > 5
assert mie["gradient"].merit.chi_square < mie["simplex after the scan"].merit.chi_square + 0.1
found = mie["gradient"]["ink.radius_nm"]
assert abs(found.value - 231) < 3 * found.standard_error

# %% [markdown]
# [A page](../docs/validation/optimisers.md) has the comparison of all methods on more problems,
# from many starts.

# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # A first fit
#
# From a measured file and a description of the sample to the optical properties of the ink. The measurement
# is the embedded one: it is **simulated**, so that the truth is known.
#
# Needs nothing but jaxink. Takes about 10 s of processor time, most of it compilation.

# %%
import matplotlib.pyplot as plt
import numpy as np

import jaxink
import jaxink.plots
from jaxink.data import SIMULATED_TRUTH, simulated_example

data_file, sample_file = simulated_example()
data = jaxink.read(data_file)
print(data.summary())

# %% [markdown]
# The sample file says what is known, and what the fit shall find: everything that is `free`.

# %%
print(sample_file.read_text())

# %% [markdown]
# ## Fit
#
# Everything that the fit found is in the result: whether the model fits within the noise (otherwise standard
# errors are meaningless), values, standard errors, and how the fit ended.

# %%
result = jaxink.fit(data, sample_file, jaxink.FitOptions(profile="all"))
print(result.summary())

# %% [markdown]
# Measured points, fitted curves, and the residuals in standard deviations of the noise below them. They
# should scatter between -2 and 2 without a pattern.

# %%
jaxink.plots.cut_figure(result, 550, "R")

# %% [markdown]
# The same BSDF as lobes, in transmission.

# %%
jaxink.plots.lobe_figure(result, 550, "T")

# %% [markdown]
# ## What is known, and how well
#
# Scattering and asymmetry parameter are strongly correlated: a thick ink shows little more than their product
# mu_s (1 - g). The corner plot shows it as a thin ellipse, and the reduced scattering is known far better
# than either of the two.

# %%
jaxink.plots.corner_figure(result)

# %%
for quantity in result.derived:
    print(f"{quantity.quantity:26s} {quantity.value:9.4f} +- {quantity.standard_error:.4f}")

# %% [markdown]
# Standard errors take chi-square for a parabola. A profile likelihood does not: one parameter is held at a
# value, all others are fitted again. Where the rise reaches 1 is the 68 % interval.

# %%
profile = next(curve for curve in result.profiles if curve.name == "ink.scattering_per_mm")
value, error = result[profile.name].value, result[profile.name].standard_error
at = np.linspace(min(profile.values), max(profile.values), 200)
figure, axes = plt.subplots(figsize=(5.5, 3.2), layout="constrained")
axes.plot(at, ((at - value) / error) ** 2, color="0.6", label="by the standard error")
axes.plot(profile.values, profile.rise, "o", label="profile")
axes.axhline(1, color="0.8", linewidth=0.8)
axes.axvline(SIMULATED_TRUTH[profile.name], color="tab:green", linestyle="--", label="truth")
axes.set(xlabel="scattering coefficient [1/mm]", ylabel="rise of chi-square")
_ = axes.legend(frameon=False)

# %% [markdown]
# Three standard errors hold the truth.

# %%
assert result.converged
assert result.verdict.reduced_chi_square < 1.2
for name, truth in SIMULATED_TRUTH.items():
    found = result[name]
    print(f"{name:26s} {found.value:9.4f} +- {found.standard_error:.4f}   truth {truth:g}")
    assert abs(found.value - truth) < 3 * found.standard_error, name

# %% [markdown]
# ## From here
#
# A saved result is a folder that every command takes: `result.save("result")`, then `jaxink export result
# --format csv --out files`. Other notebooks show [what to do when the model does not
# fit](closing_the_loop.py), [the ink in a ray tracer](inside_and_mitsuba.py), and [the forward
# model](forward_model.py) that was fitted here.

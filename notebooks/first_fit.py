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

# %%
import jax
import numpy as np

import jaxink
import jaxink.plots
from jaxink.data import SIMULATED_TRUTH, simulated_example

data_file, sample_file = simulated_example()
data = jaxink.read(data_file)
sample = jaxink.load_sample(sample_file)
data.to_dataset()

# %% [markdown]
# ## Fit
#
# Everything that the fit found is in the result: whether the model fits within the noise (otherwise standard
# errors are meaningless), values, standard errors, correlations, the misfit of each scan, and how the fit
# ended.

# %%
result = jaxink.fit(data, sample)
print(result.verdict.sentence)
print(result.summary())

# %%
for quantity in result.derived:
    print(f"{quantity.quantity:26s} {quantity.value:9.4f} +- {quantity.standard_error:.4f}")

# %% [markdown]
# Scattering and asymmetry parameter are strongly correlated: a thick ink shows little more than their product
# mu_s (1 - g). The reduced scattering is known far better than either of them.

# %%
print(np.round(result.correlations, 3))
jaxink.plots.cut_figure(result, 550, "R")

# %% [markdown]
# Three standard errors hold the truth.

# %%
for name, truth in SIMULATED_TRUTH.items():
    found = result[name]
    assert abs(found.value - truth) < 3 * found.standard_error, name

# %% [markdown]
# ## The forward model alone
#
# It predicts at any directions, and JAX differentiates it. Here: how the brightness at 30 degrees, lit at
# normal incidence, changes with each parameter, relative per relative change. JAX must compute in 64 bits.

# %%
jax.config.update("jax_enable_x64", True)
here = [np.array([v]) for v in (0.0, 30.0, 180.0, 550.0, False)]
model = jaxink.ForwardModel(result.sample, *here, jaxink.SolverConfig(**result.solver))
free = {p.name: p.value for p in result.parameters.free}
value, slope = jax.jit(jax.value_and_grad(lambda values: model.bsdf(values)[0]))(free)
for name in free:
    print(f"{name:26s} {float(slope[name]) * free[name] / float(value):+.3f}")

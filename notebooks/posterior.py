# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # The posterior by sampling
#
# Standard errors describe a posterior that is a normal distribution. The log density of a result shows what
# it really is: any sampler can use it. This notebook uses the No-U-Turn sampler of
# [NumPyro](https://num.pyro.ai). The measurement is **simulated**.
#
# Needs NumPyro (`pip install ".[posterior]"`). Takes about 75 s of processor time.

# %%
import jax

import jaxink
import jaxink.plots
from jaxink.data import SIMULATED_TRUTH, simulated_example

try:
    from numpyro.diagnostics import effective_sample_size, gelman_rubin
    from numpyro.infer import MCMC, NUTS
except ImportError:
    raise SystemExit('This notebook needs NumPyro: pip install ".[posterior]"') from None

# JAX must compute in 64 bits.
jax.config.update("jax_enable_x64", True)
result = jaxink.fit(*simulated_example(), jaxink.FitOptions(accuracy=1e-3, profile="none"))
print(result.summary())

# %% [markdown]
# ## The log density
#
# It takes the free parameters in their units, and JAX differentiates it. It contains the likelihood with the
# covariance of the fit, including the factor common to each scan, and the priors of the sample file.

# %%
density = result.log_density
values = {name: result.values[name] for name in density.free}
print(density.bounds)
print("log density of the fit:", float(density(values)))
print("slopes:", {name: float(slope) for name, slope in jax.jit(jax.grad(density))(values).items()})

# %% [markdown]
# ## Coordinates that mix
#
# Scattering and asymmetry parameter are correlated by more than 0.99. In their own units, a sampler takes
# steps as short as the narrow direction of this valley and hardly moves along it. `density.whitened` is the
# same density in coordinates from the covariance of the fit: nearly standard normal, without bounds.

# %%
n_chains, n_samples = 2, 300
sampler = MCMC(
    NUTS(potential_fn=lambda whitened: -density.whitened(whitened)),
    num_warmup=150,
    num_samples=n_samples,
    num_chains=n_chains,
    chain_method="sequential",
    progress_bar=False,
)
starts = jax.random.normal(jax.random.key(1), (n_chains, len(density.free)))
sampler.run(jax.random.key(0), init_params=starts, extra_fields=("num_steps", "diverging"))
whitened = sampler.get_samples(group_by_chain=True)
samples = jax.vmap(jax.vmap(density.from_whitened))(whitened)
steps = sampler.get_extra_fields()
print(f"{float(steps['num_steps'].mean()):.1f} gradients per sample")
print(f"{int(steps['diverging'].sum())} divergences")

# %% [markdown]
# ## Result
#
# Effective samples should be near the number of samples, and the statistic of Gelman and Rubin near 1. The
# standard deviation of the posterior is that of the fit as far as the posterior is normal.

# %%
print(f"{n_chains} x {n_samples} samples")
for name, chains in samples.items():
    effective, ratio = float(effective_sample_size(chains)), float(gelman_rubin(chains))
    print(
        f"{name:24s} {chains.mean():8.4f} +- {chains.std():.4f}  (fit {result[name].value:8.4f} +- "
        f"{result[name].standard_error:.4f}, truth {SIMULATED_TRUTH[name]:g})  {effective:5.0f} effective, "
        f"R-hat {ratio:.3f}"
    )
    assert effective > n_samples / 2, name
    assert ratio < 1.02, name

# %% [markdown]
# Grey: the samples; red: the normal distribution of the fit. They agree, so that for this ink the standard
# errors say all there is to say.

# %%
for name, chains in samples.items():
    assert abs(chains.mean() - result[name].value) < 0.5 * chains.std(), name
    assert abs(chains.std() / result[name].standard_error - 1) < 0.25, name
jaxink.plots.corner_figure(result, samples=samples)

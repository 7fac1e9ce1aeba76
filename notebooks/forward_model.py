# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # The forward model for people who build on it
#
# The model that a fit inverts is an ordinary differentiable function of JAX: parameters in, BSDF out. This
# notebook compiles it, differentiates it, and maps it over many samples, and uses each for something: which
# angles see which parameter, which measurement would determine an ink best, and how thick an ink must be.
#
# Needs nothing but jaxink. Takes about 50 s of processor time, most of it compilation.

# %%
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import optimistix as optx

import jaxink
from jaxink.data import SIMULATED_TRUTH, simulated_example
from jaxink.particles.phase_function import HenyeyGreenstein

# Whoever calls the model directly switches 64 bits on; jaxink.fit and jaxink.predict do it themselves.
jax.config.update("jax_enable_x64", True)

# %% [markdown]
# ## A model of a sample at the points of a measurement
#
# The points are those of a file, or your own. Here: the plane of incidence, every 5 degrees, at four
# incidences and on both sides. `forward_model` chooses the resolution of the solver for the requested
# accuracy.

# %%
_, sample_file = simulated_example()
sample = jaxink.load_sample(sample_file)
signed = np.arange(-80.0, 81.0, 5.0)
incidence, view, transmits = (
    column.ravel() for column in np.meshgrid([0.0, 20.0, 40.0, 60.0], signed, [False, True], indexing="ij")
)
points = jaxink.GonioData(
    theta_i_deg=incidence,
    theta_o_deg=np.abs(view),
    phi_deg=np.where(view < 0, 0.0, 180.0),
    wavelength_nm=np.full(view.size, 550.0),
    is_transmission=transmits,
    bsdf_per_sr=np.zeros(view.size),  # Not measured: a model uses the directions only.
)
model = jaxink.forward_model(sample, points, accuracy=1e-3)
print(model.config)

# %% [markdown]
# `model.bsdf` takes any of the sample's parameters by name; those that are left out have the value of the
# file.

# %%
names = list(SIMULATED_TRUTH)
truth = jnp.array([SIMULATED_TRUTH[name] for name in names])


@jax.jit
def bsdf(values):
    return model.bsdf(dict(zip(names, values, strict=True)))


f = bsdf(truth)
print(f"{f.size} points, BSDF from {f.min():.4f} to {f.max():.4f} per sr")

# %% [markdown]
# ## Derivatives: which angles see which parameter
#
# `jacfwd` gives the derivative of all points with respect to all parameters in one run, exact to rounding.

# %%
jacobian = jax.jit(jax.jacfwd(bsdf))
relative = np.asarray(jacobian(truth) * truth / f[:, None])
step = 1e-4 * truth[0] * jnp.array([1.0, 0.0, 0.0])
difference = (bsdf(truth + step) - bsdf(truth - step)) / (2e-4 * f)
assert np.allclose(relative[:, 0], difference, rtol=1e-5, atol=1e-7)

labels = ("scattering", "absorption", "asymmetry parameter")
figure, panels = plt.subplots(1, 2, figsize=(8, 3.3), sharey=True, layout="constrained")
for panel, side in zip(panels, (False, True), strict=True):
    shown = (incidence == 0) & (transmits == side)
    for column, label in enumerate(labels):
        panel.plot(view[shown], relative[shown, column], label=label)
    panel.set(title="transmission" if side else "reflection", xlabel="viewing angle [deg]")
    panel.axhline(0, color="0.8", linewidth=0.8, zorder=0)
panels[0].set_ylabel("relative change of the BSDF\nper relative change")
_ = panels[1].legend(frameon=False)

# %% [markdown]
# More scattering, more reflection and less transmission; a larger asymmetry parameter does the opposite with
# nearly the same shape. Only the small difference between these shapes tells the two apart. Absorption
# darkens both sides.

# %%
assert np.all(relative[:, 1] < 0)
assert np.all(relative[transmits, 0] < 0)
assert np.all(relative[~transmits, 0] > 0)
alike = np.corrcoef(relative[:, 0], relative[:, 2])[0, 1]
print(f"correlation of the columns of scattering and asymmetry parameter: {alike:.3f}")
assert alike < -0.95

# %% [markdown]
# ## Designing a measurement before taking it
#
# With a noise of 1 % the Jacobian gives the standard errors that a measurement *would* have (the Cramer-Rao
# bound), for any choice of scans.

# %%
whitened = relative / 0.01


def relative_errors(chosen):
    return np.sqrt(np.diag(np.linalg.inv(whitened[chosen].T @ whitened[chosen])))


plans = {
    "T at 0 deg": transmits & (incidence == 0),
    "R at 0 deg": ~transmits & (incidence == 0),
    "R and T at 0 deg": incidence == 0,
    "T at 0 to 60 deg": transmits,
    "R at 0 to 60 deg": ~transmits,
    "R and T at 0 to 60 deg": np.ones(view.size, bool),
}
errors = {plan: relative_errors(chosen) for plan, chosen in plans.items()}
print(f"{'relative standard error of':25s} {'scattering':>12s} {'absorption':>12s} {'g':>8s}")
for plan, error in errors.items():
    print(f"{plan:25s} {error[0]:12.1%} {error[1]:12.1%} {error[2]:8.1%}")

# %% [markdown]
# One scan in transmission leaves the absorption unknown; a second one, in reflection, finds it.

# %%
assert errors["R and T at 0 deg"][1] < errors["T at 0 deg"][1] / 5
assert np.all(errors["R and T at 0 to 60 deg"] < np.min([errors[p] for p in list(plans)[:-1]], axis=0))

# %% [markdown]
# ## Many samples at once
#
# `vmap` maps the model over a batch of parameters in one compiled program: here 64 inks drawn from the
# covariance that R and T at all incidences would give, and the band of BSDF that they span.

# %%
covariance = np.linalg.inv(whitened.T @ whitened)
drawn = np.random.default_rng(1).multivariate_normal(np.ones(3), covariance, size=64) * np.asarray(truth)
band = np.asarray(jax.jit(jax.vmap(bsdf))(jnp.asarray(drawn)))
spread = band.std(axis=0) / np.asarray(f)
worst = errors["R and T at 0 to 60 deg"].max()
print(f"parameters known to {worst:.1%} or better, the BSDF to {spread.max():.2%}")
assert spread.max() < worst / 5

# %% [markdown]
# The errors of the parameters compensate each other: what was measured is known better than any parameter.
#
# ## A fit of your own
#
# `jaxink.fit` does more, but the search itself takes five lines. Its solver is one of
# [optimistix](https://docs.kidger.site/optimistix), with bounds, which optimistix's own solvers do not know;
# without them, the logarithms keep the numbers positive.

# %%
measured = f * (1 + 0.01 * np.random.default_rng(2).standard_normal(f.size))


def residual(values, _):
    return (bsdf(values) - measured) / (0.01 * f)


start, low, high = jnp.array([40.0, 3.0, 0.2]), jnp.array([1.0, 0.0, -0.9]), jnp.array([500.0, 50.0, 0.95])
solver = jaxink.fitting.BoundedLevenbergMarquardt()
found = optx.least_squares(residual, solver, start, options={"lower": low, "upper": high})

# %%
plain = optx.LevenbergMarquardt(rtol=1e-6, atol=1e-6)
in_logarithms = optx.least_squares(lambda x, _: residual(jnp.exp(x), _), plain, jnp.log(start))
steps = [int(one.stats["num_steps"]) for one in (found, in_logarithms)]
print(f"steps: {steps[0]} within bounds, {steps[1]} in logarithms by optimistix's own solver")
for name, one, other in zip(names, found.value, jnp.exp(in_logarithms.value), strict=True):
    print(f"{name:26s} {one:10.5f} {other:10.5f}, true {SIMULATED_TRUTH[name]:g}")
assert np.allclose(found.value, jnp.exp(in_logarithms.value), rtol=1e-4)
assert np.allclose(found.value, truth, rtol=0.1)

# %% [markdown]
# ## One level below: a stack of layers
#
# A `Stack` has no sample file, no names and no units but optical thickness; it is what the solver sees.
# Question: how thick must this ink be to transmit 10 % of the light? Newton's method, with the derivative by
# JAX, needs a few solves.

# %%
scattering, absorption, asymmetry = (float(x) for x in truth)
extinction = scattering + absorption


def stack_of(thickness_um):
    plate = jaxink.ClearLayer(refractive_index=1.5, optical_thickness=0.0)
    ink = jaxink.ScatteringLayer(
        refractive_index=1.5,
        optical_thickness=extinction * thickness_um / 1000,
        single_scattering_albedo=scattering / extinction,
        phase_function=HenyeyGreenstein(asymmetry),
    )
    return jaxink.Stack((plate, ink), index_front=1.0, index_back=1.0)


# Resolution and plan are chosen once, from known numbers; a traced stack has none.
config, plan = jaxink.choose_sizes(stack_of(80.0), accuracy=1e-3), jaxink.plan_channels(stack_of(80.0))


@jax.jit
def powers(thickness_um):
    reflected, transmitted = jaxink.hemispherical_power(stack_of(thickness_um), np.zeros(1), config, plan)
    return reflected[0], transmitted[0]


# In the logarithms transmittance is nearly linear.
step = jax.jit(jax.value_and_grad(lambda log_um: jnp.log(powers(jnp.exp(log_um))[1])))
log_um = jnp.log(80.0)
for _ in range(6):
    log_transmittance, slope = step(log_um)
    print(f"{jnp.exp(log_um):8.3f} um transmits {jnp.exp(log_transmittance):.6f}")
    log_um += (jnp.log(0.1) - log_transmittance) / slope
thickness = float(jnp.exp(log_um))
assert abs(float(powers(thickness)[1]) - 0.1) < 1e-6

# %%
grid = jnp.linspace(5.0, 300.0, 60)
reflected, transmitted = jax.vmap(powers)(grid)
figure, axes = plt.subplots(figsize=(5.5, 3.2), layout="constrained")
axes.plot(grid, reflected, label="reflectance")
axes.plot(grid, transmitted, label="transmittance")
axes.plot(grid, 1 - reflected - transmitted, label="absorptance")
axes.plot([thickness], [0.1], "o", color="k", label=f"10 % at {thickness:.1f} um")
axes.set(xlabel="thickness of the ink [um]", ylabel="share of the incident power", ylim=(0, 1))
_ = axes.legend(frameon=False)

# %%
assert np.all(np.diff(transmitted) < 0)
assert np.all(np.diff(1 - reflected - transmitted) > 0)

# %% [markdown]
# `result.log_density` of a fit is a function of the same kind; [posterior.py](posterior.py) samples it.

# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # An effect of your own
#
# The catalogue of a diagnosis is open: whoever knows an instrument or an ink can add what it may do. Here the
# detector of a goniometer loses part of the light at grazing angles, because its field of view is stopped
# down by the frame of the sample. The measurement is the embedded **simulated** one, to which this loss is
# applied, so that its strength of 0.3 is known.
#
# Needs nothing but jaxink. Takes about 50 s of processor time, most of it compilation.

# %%
import dataclasses
import tempfile

import jax
import matplotlib.pyplot as plt
import numpy as np

import jaxink
import jaxink.plots
from jaxink.data import SIMULATED_TRUTH, simulated_example
from jaxink.effects import CATALOGUE, ReadingEffect
from jaxink.plots import diagnosis_figures

LOSS = 0.3
data_file, sample_file = simulated_example()
clean = jaxink.read(data_file)
seen = 1 - LOSS * (clean.theta_o_deg / 90) ** 4
data = clean.replace(bsdf_per_sr=clean.bsdf_per_sr * seen, sigma_per_sr=clean.sigma_per_sr * seen)

# %% [markdown]
# ## The misfit
#
# The declared model does not fit. Its scattering and asymmetry parameter move away from the truth to make up
# for the loss, and cannot.

# %%
options = jaxink.FitOptions(accuracy=1e-3, profile="none")
declared = jaxink.fit(data, sample_file, options)
print(declared.verdict.sentence)
for name, truth in SIMULATED_TRUTH.items():
    print(f"{name:26s}{declared[name].value:9.4g}, truth {truth:g}")
assert declared.verdict.reduced_chi_square > 1.5

# %%
jaxink.plots.cut_figure(declared, 550, "T")

# %% [markdown]
# ## The effect
#
# It derives from the kind that says what differs from the declared model. Here it is the readings of the
# instrument, a `ReadingEffect`; its method `change` turns the BSDF at the points into what the detector
# reads. Other kinds change the sample, a share of its area, or the solver ([all
# kinds](../docs/manual/diagnosis.md#an-effect-of-your-own)). The first term is the strength; at its
# value, 0, the
# model must be the declared one.


# %%
@dataclasses.dataclass(frozen=True)
class Vignetting(ReadingEffect):
    """The field of view shrinks towards grazing angles."""

    name, statement = "vignetting", "the detector sees less of the sample at grazing angles"
    terms = (jaxink.Parameter("vignetting.loss", 0.0, True, 0.0, 1.0),)

    def change(self, predicted, values, field):
        """Return y = f (1 - s (theta_o / 90 deg)^4)."""
        return predicted * (1 - values["vignetting.loss"] * (field.scene.theta_o_deg / 90) ** 4)


# %% [markdown]
# ## Is it tested fairly?
#
# It competes with the instrument's effects of the catalogue. The p-value of an effect that was thought of
# *after* looking at the residual is not valid; this one follows from the instrument.

# %%
instrument = tuple(effect for effect in CATALOGUE if effect.group == "instrument")
diagnosis = jaxink.diagnose(
    data,
    sample_file,
    jaxink.DiagnosisOptions(fit=options, catalogue=(*instrument, Vignetting)),
    fitted=declared,
)
print(diagnosis.summary())

# %%
figures = {f.name: f.figure for f in diagnosis_figures(diagnosis)}
figures["candidates"]

# %%
step = diagnosis.steps[0]
print(f"{step.effect}: {step.strength:.4f} +- {step.standard_error:.4f}, applied {LOSS}")
assert diagnosis.verdict.effects == ("vignetting",)
assert abs(step.strength - LOSS) < 3 * step.standard_error
for name, truth in SIMULATED_TRUTH.items():
    after = diagnosis.corrected[name]
    print(f"{name:26s}{after.value:9.4g} +- {after.standard_error:.2g}, truth {truth:g}")
    assert abs(after.value - truth) < 3 * after.standard_error, name

# %% [markdown]
# ## Without it in the catalogue
#
# The screen shows how far the others would have come. A detector that is not linear imitates much of the
# loss, since it is dark at grazing angles; a diagnosis that knows nothing of vignetting would begin with
# that, and what is left would still be far above the noise.

# %%
for row in diagnosis.candidates[:4]:
    print(f"{row.effect:16s} predicted decrease in chi-square {row.predicted_delta_chi_square:8.1f}")
best, second = diagnosis.candidates[:2]
assert best.effect == "vignetting"
left_by_second = diagnosis.before.fitted.chi_square - second.predicted_delta_chi_square
print(f"{second.effect} would leave a chi-square of {left_by_second:.0f} for {clean.used.sum()} points")
assert left_by_second > 5 * clean.used.sum()

# %% [markdown]
# ## Saved, loaded and declared
#
# A file contains only the name of the effect, never its code; whoever loads it passes the class.

# %%
with tempfile.TemporaryDirectory() as folder:
    diagnosis.save(folder)
    loaded = jaxink.load_diagnosis(folder, effects=[Vignetting])
corrected = loaded.corrected
np.testing.assert_allclose(corrected.predicted_per_sr, diagnosis.corrected.predicted_per_sr)
loss = corrected["vignetting.loss"]
print(f"{loss.name} = {loss.value:.4f} +- {loss.standard_error:.4f}")

# %% [markdown]
# From then on it is a parameter like any other: fixed, free, with a prior, and differentiable.

# %%
jax.config.update("jax_enable_x64", True)
model = corrected.forward_model()
slope = jax.jit(jax.jacfwd(lambda loss: model.bsdf({"vignetting.loss": loss})))(
    corrected["vignetting.loss"].value
)
figure, axes = plt.subplots(figsize=(5.5, 3.2), layout="constrained")
shown = (data.theta_i_deg == 0) & data.is_transmission
signed = np.where(data.phi_deg == 180, 1, -1) * data.theta_o_deg
order = np.flatnonzero(shown)[np.argsort(signed[shown])]
axes.plot(signed[order], data.bsdf_per_sr[order], ".", color="0.5", label="readings")
axes.plot(signed[order], corrected.predict()[order], label="model with the loss")
without = model.bsdf({"vignetting.loss": 0.0})
axes.plot(signed[order], without[order], "--", label="the sample itself")
axes.set(xlabel="signed polar angle [deg]", ylabel="BSDF in transmission [1/sr]")
_ = axes.legend(frameon=False)

# %%
assert np.all(slope <= 0)
clean_ratio = np.asarray(without)[clean.used] / clean.bsdf_per_sr[clean.used]
print(f"the sample without the loss against the clean measurement: rms {100 * np.std(clean_ratio):.2f} %")
assert np.sqrt(np.mean((clean_ratio - 1) ** 2)) < 0.008

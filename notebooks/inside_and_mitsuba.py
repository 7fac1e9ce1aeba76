# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # The ink from inside, and into Mitsuba
#
# A goniometer sees an ink through its plate. A light guide needs what the goniometer never sees: the BSDF of
# the ink alone for light that is inside the plate, beyond the critical angle as well. This notebook extracts
# it from a fit to the embedded **simulated** measurement, checks it, and writes it for the ray tracer
# [Mitsuba 3](https://www.mitsuba-renderer.org).
#
# Needs nothing but jaxink; with Mitsuba (`pip install mitsuba`) it also renders a picture. Takes about 45 s
# of processor time, most of it compilation.

# %%
import importlib
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import jaxink
import jaxink.plots
from jaxink.data import simulated_example
from jaxink.export import ExportOptions, write
from jaxink.ink import TableOptions, verify_sheet

result = jaxink.fit(*simulated_example(), jaxink.FitOptions(accuracy=1e-3, profile="none"))
print(result.verdict.sentence)
jaxink.plots.lobe_figure(result, 550, "T")

# %% [markdown]
# ## The table
#
# Four components: `R_II` reflects light from inside back to the inside, `T_IA` lets it out into the air;
# `T_AI` and `R_AA` are for light from the air. Angles on side I are angles *in the plate*. By default a table
# has at least 61 polar angles; fewer are faster, and the table itself estimates what they cost.

# %%
options = TableOptions(n_theta=45, n_phi=25, accuracy=1e-3)
table = jaxink.ink_table(result, options=options)
print(table.summary())

# %%
jaxink.plots.table_lobe_figure(table, "R_II", (0, 20, 40, 55))

# %%
jaxink.plots.table_lobe_figure(table, "T_IA", (0, 30, 41, 60, 80))

# %% [markdown]
# Light that arrives beyond the critical angle of 41.8 degrees cannot leave the plate by refraction, and yet
# the ink lets it out: that is what makes a light guide shine.

# %%
critical = np.rad2deg(np.arcsin(1 / 1.5))
beyond = table.interpolated("T_IA", 60.0, np.array([0.0, 30.0]), np.array([0.0, 180.0]), 0)
print(f"critical angle {critical:.1f} deg; BSDF from 60 deg inside to 0 and 30 deg outside: {beyond}")
assert np.all(beyond > 0.02)
component = dict(zip(("R_II", "T_IA", "T_AI", "R_AA"), range(4), strict=True))
assert table.regular[component["T_IA"], 0, table.theta_deg > critical + 0.1].max() == 0

# %% [markdown]
# Reciprocity across the index step has the squared index: whoever uses one transmission for the other is
# wrong by
# 2.25.

# %%
T_IA, T_AI = (table.bsdf_per_sr[component[name], 0] for name in ("T_IA", "T_AI"))
inner = table.theta_deg < 80
forth = T_IA[np.ix_(inner, inner)]
back = np.swapaxes(T_AI[np.ix_(inner, inner)], 0, 1) / 1.5**2
print(f"largest deviation from reciprocity: {np.abs(forth / back - 1).max():.1e}")
np.testing.assert_allclose(forth, back, rtol=2e-3)

# %% [markdown]
# ## Is it right?
#
# Put the table back between plate and air, as an infinitely thin sheet, and compute what the goniometer would
# see. It must be the model that was fitted, and the measurement.

# %%
check = verify_sheet(table, result, theta_i_deg=(0.0, 30.0, 60.0))
figure, axes = plt.subplots(figsize=(6.5, 3.2), layout="constrained")
for side, marker in (("R", "o"), ("T", "s")):
    for lit, colour in (("inside", "C0"), ("outside", "C3")):
        rows = [c for c in check.checks if (c.side, c.lit_from) == (side, lit)]
        percent = [100 * row.largest_difference for row in rows]
        light = "plate" if lit == "inside" else "ink"
        axes.plot(
            [r.theta_i_deg for r in rows],
            percent,
            marker,
            color=colour,
            label=f"{side}, lit from the {light}",
        )
axes.set(xlabel="incidence [deg]", ylabel="sheet against full model,\nlargest difference [%]", ylim=(0, None))
_ = axes.legend(frameon=False, fontsize=8)

# %%
for side in "RT":
    sheet, model = 100 * check.sheet_rms[side], 100 * check.model_rms[side]
    print(f"{side}: against the measurement, rms: sheet {sheet:.2f} %, fitted model {model:.2f} %")
    assert sheet < model + 0.1
assert check.largest_difference < 0.01

# %% [markdown]
# ## Into Mitsuba
#
# The export writes the table, a plug-in that reads it, a scene, and a guide that says what was lost.
# Mitsuba's files cannot represent standard errors; jaxink asks for consent to that.

# %%
temporary = tempfile.TemporaryDirectory()
folder = Path(temporary.name)
paths = write(table, "mitsuba", folder, ExportOptions(drop=("standard_errors",)))
for path in paths:
    print(f"{path.stat().st_size / 1000:8.1f} kB  {path.name}")
print((folder / "ink_README.txt").read_text())
assert {"ink.nc", "jaxink_table.py", "example_scene.py"} <= {path.name for path in paths}

# %% [markdown]
# The scene is a plate of acrylic with the ink on its lower face, lit by a lamp at its left edge. The picture
# shows the plate from above: bright near the lamp, darker away from it.

# %%
if importlib.util.find_spec("mitsuba") is None:
    picture = None
    print("Mitsuba is not installed; `python example_scene.py ink.nc picture.exr` would render the picture.")
else:
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    sys.path.insert(0, str(folder))
    example = importlib.import_module("example_scene")
    importlib.import_module("jaxink_table")
    scene = example.plate_with_ink(str(folder / "ink.nc"), size=(80, 60), samples=64)
    picture = np.array(mitsuba.render(mitsuba.load_dict(scene)))[..., :3].mean(axis=-1)
    figure, axes = plt.subplots(figsize=(6.5, 3.2), layout="constrained")
    picture = picture[14:50]
    drawn = axes.imshow(picture, cmap="gray", vmax=np.quantile(picture, 0.95))
    axes.set_axis_off()
    figure.colorbar(drawn, label="radiance", shrink=0.8)

# %%
if picture is not None:
    near, far = picture[10:24, 20:28].mean(), picture[10:24, 50:58].mean()
    print(f"radiance near the lamp {near:.3f}, away from it {far:.3f}")
    assert near > far > 0
temporary.cleanup()

# %% [markdown]
# The same table goes to Zemax, LightTools, Speos, Radiance and CSV; [what each format can
# represent](../docs/manual/export.md#what-each-format-can-represent).

"""Draw the figure of the README: a simulated scan, its fits without and with the effect, and the ink inside.

python -m benchmarks.readme_figure
"""

import matplotlib.pyplot as plt
import numpy as np

import jaxink
from benchmarks.pages import REPOSITORY
from jaxink.data import stray_light_example
from jaxink.effects import CATALOGUE
from jaxink.ink import COMPONENTS

TARGET = REPOSITORY / "docs" / "readme.png"
# As `jaxink demo`: effects that share the program of the fit.
EFFECTS = ("gain", "side_gain", "stray_light", "signal_floor", "drift", "pinholes")
SCAN_DEG, INSIDE_DEG = 60.0, (0.0, 30.0, 60.0)
DECLARED, CORRECTED = "tab:red", "tab:blue"


def main() -> None:
    """Diagnose the embedded measurement and draw."""
    data, sample = stray_light_example()
    some = tuple(effect for effect in CATALOGUE if effect.name in EFFECTS)
    found = jaxink.diagnose(data, sample, jaxink.DiagnosisOptions(catalogue=some))
    figure, axes = plt.subplot_mosaic(
        [["scan", "inside"], ["residual", "inside"]],
        figsize=(9, 3.6),
        height_ratios=[2, 1],
        layout="constrained",
    )
    _draw_scan(axes["scan"], axes["residual"], found)
    _draw_inside(axes["inside"], jaxink.ink_table(found.corrected))
    figure.savefig(TARGET, dpi=150, metadata={"Software": None})


def _draw_scan(above: plt.Axes, below: plt.Axes, found: jaxink.Diagnosis) -> None:
    """One scan in reflection with both models, and by how much the measured values exceed each."""
    data = found.declared.data
    here = data.used & (data.theta_i_deg == SCAN_DEG) & ~data.is_transmission
    signed = np.where(np.abs(data.phi_deg) > 90, data.theta_o_deg, -data.theta_o_deg)[here]
    order = np.argsort(signed)
    measured, angle = data.bsdf_per_sr[here][order], signed[order]
    above.plot(angle, measured, "k.", markersize=4, label="measured (simulated)")
    models = (
        (found.declared, DECLARED, "best fit of the declared model"),
        (found.corrected, CORRECTED, f"with {', '.join(found.verdict.effects).replace('_', ' ')}"),
    )
    for fit, colour, label in models:
        predicted = np.full(len(data), np.nan)
        predicted[data.used] = fit.predicted_per_sr
        above.plot(angle, predicted[here][order], color=colour, label=label)
        below.plot(angle, 100 * (measured / predicted[here][order] - 1), ".-", color=colour, markersize=3)
    above.set(ylabel="BRDF, 1/sr", title=f"The plate, in air, incidence {SCAN_DEG:g}°")
    above.tick_params(labelbottom=False)
    above.legend(fontsize="small")
    below.axhline(0, color="0.7", linewidth=0.8)
    below.set(xlabel="viewing angle, deg (negative: towards source)", ylabel="measured /\nmodel - 1, %")


def _draw_inside(axes: plt.Axes, table: jaxink.InkTable) -> None:
    """BSDF of the ink as light of the plate meets it, at some incidences."""
    inside = table.bsdf_per_sr[COMPONENTS.index("R_II"), 0]
    for incidence in INSIDE_DEG:
        row = inside[np.argmin(np.abs(table.theta_deg - incidence))]
        angle = np.concatenate([-table.theta_deg[::-1], table.theta_deg])
        axes.plot(angle, np.concatenate([row[::-1, 0], row[:, -1]]), label=f"incidence {incidence:g}°")
    critical = np.rad2deg(np.arcsin(1 / table.index_inside[0]))
    for sign in (-1, 1):
        axes.axvline(sign * critical, color="0.7", linewidth=0.8, linestyle="--")
    axes.set(
        xlabel="angle inside, deg (dashed: beyond, total reflection)",
        ylabel="BRDF of the ink, 1/sr",
        title="The ink, inside the plate",
        xlim=(-90, 90),
    )
    axes.set_ylim(bottom=0)
    axes.legend(fontsize="small")


if __name__ == "__main__":
    main()

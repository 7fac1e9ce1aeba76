"""Section on the stacks of discs: as one slab, and with the gaps between them."""

from pathlib import Path

import numpy as np

from benchmarks.pages import filled, rms, table
from benchmarks.validation.totals.discs import (
    ASYMMETRY,
    OTHER_ASYMMETRIES,
    PTFE,
    THICKNESS_SIGMA_MM,
    DiscFit,
    Discs,
    discs,
    fit_discs,
    predictor,
)
from benchmarks.validation.totals.layers import refusal

BEFORE, ONE_SLAB_BARE, AFTER = "one slab, n = 1.35", "one slab, no interface", "discs with gaps, n = 1.35"
# Index of the interface, and whether there are gaps.
MODELS = {BEFORE: (1.35, False), ONE_SLAB_BARE: (1.0, False), AFTER: (1.35, True)}
NOISES = NONE, EACH_STACK, EACH_KIND = "none", "of each stack", "of each kind of disc"
LEAST_PULL = 2.0


class Fits:
    """Fits of one model: by the thickness errors allowed, with other g, and with each stack left out."""

    def __init__(self, data: Discs, index: float, gaps: bool):
        predict = predictor(data, index, gaps)
        own = THICKNESS_SIGMA_MM * np.eye(data.thickness_mm.size)
        errors = {NONE: 0 * own, EACH_STACK: own, EACH_KIND: THICKNESS_SIGMA_MM * data.made_of()[1]}
        self.by_noise = {noise: fit_discs(predict, data, errors[noise]) for noise in NOISES}
        self.others = [fit_discs(predict, data, own, g).chi_square for g in OTHER_ASYMMETRIES]
        each = np.arange(data.thickness_mm.size)
        self.left_out = np.array([fit_discs(predict, data, own, used=each != k).deviation[k] for k in each])

    @property
    def best(self) -> DiscFit:
        """That with an error of each stack."""
        return self.by_noise[EACH_STACK]

    def row(self, name: str) -> list[str]:
        """Row of the models' table."""
        best = self.best
        reduced, absorption = np.exp(best.parameters[0]), best.parameters[1]
        return [
            name,
            *(f"{fit.chi_square:.1f}" for fit in self.by_noise.values()),
            ", ".join(f"{chi_square:.1f}" for chi_square in self.others),
            f"{rms(best.deviation):.3f}",
            f"{rms(self.left_out):.3f}",
            with_error(reduced, reduced * best.standard_errors[0]),
            with_error(absorption, best.standard_errors[1], 2),
            "absorption at lower bound" if best.at_bound else "none at a bound",
        ]


def with_error(value: float, error: float, digits: int = 3) -> str:
    """A value and its standard error, if it has one."""
    return f"{value:.{digits}g}" + ("" if np.isnan(error) else f" ± {error:.2g}")


def composition(single_mm, made) -> str:
    """Thicknesses of the discs of a stack."""
    return " + ".join(f"{thickness:g}" for thickness in np.repeat(single_mm, made))


def models_table(fits: dict[str, Fits]) -> str:
    """Table of the models."""
    header = [
        "model",
        *(f"chi-square, thickness error {noise}" for noise in NOISES),
        f"as the second, g = {', '.join(f'{g:g}' for g in OTHER_ASYMMETRIES)}",
        "rms of ln T",
        "rms of ln T, stacks left out",
        "reduced scattering, 1/mm",
        "absorption, 1/mm",
        "flag",
    ]
    return table(header, [some.row(name) for name, some in fits.items()])


def stacks_table(data: Discs, fits: dict[str, Fits]) -> str:
    """Table of the stacks."""
    single, counts = data.made_of()
    rows = [
        [
            f"{thickness:g}",
            composition(single, made),
            *(" / ".join(f"{r:.3f}" for r in np.exp(some.best.deviation[k])) for some in fits.values()),
            *(f"{rms(some.left_out[k]):.3f}" for some in fits.values()),
        ]
        for k, (thickness, made) in enumerate(zip(data.thickness_mm, counts, strict=True))
    ]
    header = ["thickness, mm", "discs, mm", *MODELS, *(f"left out: {name}" for name in MODELS)]
    return table(header, rows)


def sentence_of_kinds(by_kind: list[float], freedom: int) -> str:
    """What an error of each kind of disc does to the two models."""
    found = f"chi-square is {by_kind[0]:.1f} without the gaps and {by_kind[1]:.1f} with them"
    if max(by_kind) >= 1.5 * freedom:
        return f"{found}."
    return f"{found}: the thickness of the thin discs, wrong by as much in each, can stand in for the gaps."


def points_left(data: Discs, fits: dict[str, Fits]) -> str:
    """List of points that a model misses."""
    lines = []
    for name, some in fits.items():
        pulls = some.best.deviation / some.best.sigma
        far = [
            f"{data.thickness_mm[k]:g} mm at {data.theta_deg[a]:g}° ({pulls[k, a]:+.1f})"
            for k, a in np.argwhere(np.abs(pulls) > LEAST_PULL)
        ]
        lines.append(f"- {name}: {', '.join(far) or 'none'}")
    return "\n".join(lines)


def kinds_left(data: Discs, after: DiscFit) -> str:
    """Model over measured of stacks of one kind of disc."""
    single, counts = data.made_of()
    return ", ".join(
        f"{np.exp(after.deviation[k].mean()):.3f} ({composition(single, made)} mm)"
        for kind in range(single.size)
        for k, made in enumerate(counts)
        if made[kind] == made.sum()
    )


def discs_section() -> str:
    """The section."""
    data = discs()
    fits = {name: Fits(data, *model) for name, model in MODELS.items()}
    before, after = fits[BEFORE], fits[AFTER]
    most = int(np.argmax(data.n_discs))
    n_scales, n_parameters = data.theta_deg.size, before.best.parameters.size
    freedom = data.transmitted.size - n_scales - n_parameters
    pairs = [(before.by_noise[noise], after.by_noise[noise]) for noise in NOISES]
    return filled(
        Path(__file__).with_name("discs.md.in"),
        file=PTFE[0],
        last_deg=data.theta_deg[-1],
        largest=data.transmitted.max(),
        values=data.transmitted.size,
        n_scales=n_scales,
        n_parameters=n_parameters,
        freedom=freedom,
        asymmetry=ASYMMETRY,
        sigma_percent=100 * np.median(data.sigma / data.transmitted),
        thickness_sigma_mm=THICKNESS_SIGMA_MM,
        models=models_table(fits),
        angles=" / ".join(f"{theta:g}" for theta in data.theta_deg),
        stacks=stacks_table(data, fits),
        verdict="better" if after.best.chi_square < before.best.chi_square else "worse",
        before=before.best,
        after=after.best,
        changes=", ".join(f"{new.deviance - old.deviance:+.1f}" for old, new in pairs),
        kinds_sentence=sentence_of_kinds([fit.chi_square for fit in pairs[-1]], freedom),
        most_discs=data.n_discs[most],
        most_mm=data.thickness_mm[most],
        missed_before=rms(before.left_out[most]),
        missed_after=rms(after.left_out[most]),
        reduced=after.best.chi_square / freedom,
        least_pull=LEAST_PULL,
        far_points=points_left(data, fits),
        kinds=kinds_left(data, after.best),
        refusal=refusal(*PTFE),
    )

"""How much of a residual lies in few smooth modes, where these are, and the same in words."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, Int
from scipy.special import fdtrc

from jaxink.display.brief import brief_repr
from jaxink.residual.modes import Mode, modes_for
from jaxink.residual.points import ResidualPoints
from jaxink.residual.shares import CarriedShare, ModeShare, OrderShare, ScanShare
from jaxink.residual.symmetry import Asymmetry, asymmetries

if TYPE_CHECKING:
    import pandas


# Neighbouring wavelengths share amplitudes, such that there are at most so many.
_MOST_BANDS = 8
_MOST_MODES = 12
# Modes up to this order are tested together for structure.
_TESTED_ORDER = 4
# Less of a column than this after a projection is rounding.
_DEGENERATE = 1e-4
_SIDES = {"R": "reflection", "T": "transmission"}
_AZIMUTH = {
    0: "the same at all azimuths",
    1: "opposite towards and away from the source (cos phi)",
    2: "opposite in and across the plane of incidence (cos 2 phi)",
}
# An extreme is named if it is at least this share of the larger one.
_SECOND = 0.4
# Levels of incidence or wavelength are compared if their rms differ by this factor.
_DIFFERS = 1.5
# Below this share the modes are not what the residual mainly consists of.
_HALF = 0.5
_CAUSES = {
    "mirror": (
        "+phi and -phi",
        "no isotropic sample does this, so a tilted plate, a misaligned azimuth, or grooves are behind it",
    ),
    "reciprocal": (
        "source and detector exchanged",
        "no reciprocal sample does this, so the instrument (illuminated area, field of view) or light that "
        "leaves sideways is behind it",
    ),
}


@dataclass(frozen=True, eq=False)
class ResidualShape:
    """The shape of a residual.

    Parameters
    ----------
    sentence
        Description.
    excess
        Chi-square minus degrees of freedom.
    share
        Share of the excess that the modes carry.
    p_value
        Probability that noise of any level puts as much into the modes up to order 4 (F test).
    modes
        The modes that the residual contains, in the order of their choice.
    n_considered
        Number of modes that were considered.
    orders
        Chi-square carried by all modes up to each order.
    scans
        The same modes by scan.
    asymmetries
        What no isotropic, reciprocal sample has.
    relative
        The part of measured / predicted - 1 that the modes carry, at each point.
    whitened
        The same in units of the noise; rows after the points belong to priors.
    smooth_share
        Share of the excess that varies smoothly with direction, on whatever scale, these modes included; None
        if it is not known.
    """

    __repr__ = brief_repr

    sentence: str
    excess: float
    share: float
    p_value: float
    modes: tuple[ModeShare, ...]
    n_considered: int
    orders: tuple[OrderShare, ...]
    scans: tuple[ScanShare, ...]
    asymmetries: tuple[Asymmetry, ...]
    relative: Float[np.ndarray, " points"]
    whitened: Float[np.ndarray, " rows"]
    smooth_share: float | None = None

    def overlap(self, column: Float[np.ndarray, " rows"]) -> float:
        """Cosine between a direction, without what the free parameters reproduce, and the modes' part."""
        length = float(np.linalg.norm(column) * np.linalg.norm(self.whitened))
        return float(column @ self.whitened) / length if length > 0 else 0.0

    def to_frame(self) -> "pandas.DataFrame":
        """The modes as a pandas DataFrame, one row for each mode and band of wavelengths."""
        import pandas

        return pandas.DataFrame(
            [
                {**row, "wavelength_nm": nm, "amplitude": amplitude, "standard_error": error}
                for row, share in zip(map(_mode_row, self.modes), self.modes, strict=True)
                for nm, amplitude, error in zip(
                    share.wavelength_nm, share.amplitude, share.standard_error, strict=True
                )
            ]
        )

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``report.json`` and ``result.json``, for `jaxink.files.encoding.plain`."""
        return {
            "sentence": self.sentence,
            "excess_chi_square": self.excess,
            "share": self.share,
            "smooth_share": self.smooth_share,
            "p_value": self.p_value,
            "modes_considered": self.n_considered,
            "modes": [
                {
                    **_mode_row(share),
                    "wavelength_nm": share.wavelength_nm,
                    "amplitude": share.amplitude,
                    "standard_error": share.standard_error,
                }
                for share in self.modes
            ],
            "orders": [order._asdict() for order in self.orders],
            "scans": [scan._asdict() for scan in self.scans],
            "asymmetries": self.asymmetries,
        }


def _mode_row(share: ModeShare) -> dict[str, Any]:
    mode = share.mode
    return {
        "side": mode.side,
        "order_incidence": mode.n,
        "order_view": mode.m,
        "azimuthal_order": mode.azimuthal_order,
        "chi_square": share.chi_square,
    }


def residual_shape(
    points: ResidualPoints,
    removed: Float[np.ndarray, "rows rank"] | None = None,
    structured: float | None = None,
) -> ResidualShape:
    """Modes of a residual, chosen one by one by the largest decrease in chi-square.

    Parameters
    ----------
    points
        The residual at the end of a fit.
    removed
        Orthonormal basis of what the free parameters reproduce; None if unknown: modes then seem to
        carry less than they do.
    structured
        Share of the residual's mean square that varies smoothly, on whatever scale; None if unknown.
    """
    basis = np.zeros((points.whitened.size, 0)) if removed is None else removed
    residual = points.whitened - basis @ (basis.T @ points.whitened)
    bands = _bands(points)
    modes = modes_for(points)
    blocks = [_columns(points, mode, bands, basis) for mode in modes]
    chosen, gains = _chosen(residual, [whitened for _, whitened in blocks])
    n_bands = int(bands.max()) + 1
    raw, whitened = (
        np.concatenate([blocks[i][part] for i in chosen], axis=1) if chosen else np.zeros((size, 0))
        for part, size in ((0, len(points)), (1, residual.size))
    )
    amplitude, error = _amplitudes(whitened, residual)
    carried = whitened @ np.nan_to_num(amplitude)
    total, n_carried = float(residual @ residual), int(np.sum(np.isfinite(amplitude)))
    freedom = int(np.count_nonzero(points.weight)) - basis.shape[1]
    excess = total - freedom
    gain = total - float(np.sum((residual - carried) ** 2))
    nm = _means(points.wavelength_nm, bands)
    shape = np.zeros((len(chosen), n_bands))
    shares = tuple(
        ModeShare(modes[i], float(g), nm, a, e)
        for i, g, a, e in zip(
            chosen, gains, amplitude.reshape(shape.shape), error.reshape(shape.shape), strict=True
        )
    )
    part = points.unwhiten(carried)
    orders = _order_shares(modes, blocks, residual)
    share = float(np.clip((gain - n_carried) / excess, 0, 1)) if excess > 0 else 0.0
    smooth = None
    if structured is not None and excess > 0:
        # The modes are smooth themselves; both are shares of what exceeds the noise.
        smooth = float(np.clip(max(structured * total / excess, share), 0, 1))
    carried_by = CarriedShare(len(modes), excess, share, orders, smooth)
    scans = _scan_shares(points, residual, carried, part)
    found = asymmetries(points)
    return ResidualShape(
        sentence=shape_sentence(points, shares, carried_by, part, found),
        excess=excess,
        share=share,
        p_value=_p_value(orders, total, freedom),
        modes=shares,
        n_considered=len(modes),
        orders=orders,
        scans=scans,
        asymmetries=found,
        relative=part,
        whitened=carried,
        smooth_share=smooth,
    )


def _bands(points: ResidualPoints) -> Int[np.ndarray, " points"]:
    """Number of the band of each point; each wavelength is one if there are few."""
    wavelengths, which = np.unique(points.wavelength_nm, return_inverse=True)
    groups = np.array_split(np.arange(wavelengths.size), min(_MOST_BANDS, wavelengths.size))
    band = np.concatenate([np.full(group.size, i) for i, group in enumerate(groups)])
    return band[which.reshape(-1)]


def _means(values, bands) -> Float[np.ndarray, " bands"]:
    return np.bincount(bands, values) / np.bincount(bands)


def _columns(points: ResidualPoints, mode: Mode, bands, basis) -> tuple[np.ndarray, np.ndarray]:
    """A mode in each band: relative change, and whitened without what the parameters reproduce."""
    relative = mode.values(points)[:, None] * (bands[:, None] == np.arange(bands.max() + 1))
    column = points.whiten(relative)
    rest = column - basis @ (basis.T @ column)
    rest -= basis @ (basis.T @ rest)
    kept = np.linalg.norm(rest, axis=0) > _DEGENERATE * np.linalg.norm(column, axis=0)
    return relative, np.where(kept, rest, 0.0)


def _span(columns: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Orthonormal basis of columns after a projection off others; those that hardly change are left out."""
    rest = columns - before @ (before.T @ columns)
    rest -= before @ (before.T @ rest)
    size = np.linalg.norm(columns, axis=0)
    kept = np.linalg.norm(rest, axis=0) > _DEGENERATE * size
    left, singular, _ = np.linalg.svd(rest[:, kept] / size[kept], full_matrices=False)
    return left[:, singular > _DEGENERATE] if singular.size else np.zeros((len(columns), 0))


def _chosen(residual: np.ndarray, blocks: list[np.ndarray]) -> tuple[list[int], list[float]]:
    """Positions of the modes in the order of their choice, and the decrease in chi-square by each."""
    taken, gains = list[int](), list[float]()
    before, left = np.zeros((residual.size, 0)), residual
    for _ in range(min(_MOST_MODES, len(blocks))):
        spans = {i: _span(block, before) for i, block in enumerate(blocks) if i not in taken}
        worth = {i: float(np.sum((span.T @ left) ** 2)) for i, span in spans.items()}
        # Modes that are alike at these points: the one of the lowest order.
        best = min(worth, key=lambda i: (-round(worth[i], 6), i))
        cost = spans[best].shape[1] * np.log(residual.size) + 2 * np.log(len(blocks))
        if worth[best] <= cost:
            break
        taken.append(best)
        gains.append(worth[best])
        before = np.concatenate([before, spans[best]], axis=1)
        left = left - spans[best] @ (spans[best].T @ left)
    return taken, gains


def _amplitudes(columns: np.ndarray, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least squares amplitudes and standard errors; nan for columns that are 0."""
    amplitude, error = np.full((2, columns.shape[1]), np.nan)
    size = np.linalg.norm(columns, axis=0)
    there = size > 0
    if there.any():
        scaled = columns[:, there] / size[there]
        inverse = np.linalg.pinv(scaled, rcond=_DEGENERATE)
        amplitude[there] = inverse @ residual / size[there]
        error[there] = np.sqrt(np.sum(inverse**2, axis=1)) / size[there]
    return amplitude, error


def _order_shares(modes, blocks, residual) -> tuple[OrderShare, ...]:
    found, basis = [], np.zeros((residual.size, 0))
    for order in sorted({mode.order for mode in modes}):
        columns = [block for mode, (_, block) in zip(modes, blocks, strict=True) if mode.order == order]
        basis = np.concatenate([basis, _span(np.concatenate(columns, axis=1), basis)], axis=1)
        found.append(OrderShare(order, basis.shape[1], float(np.sum((basis.T @ residual) ** 2))))
    return tuple(found)


def _p_value(orders: tuple[OrderShare, ...], total: float, freedom: int) -> float:
    tested = [found for found in orders if found.order <= _TESTED_ORDER][-1]
    rest = freedom - tested.amplitudes
    if not tested.amplitudes or rest <= 0:
        return 1.0
    left = max(total - tested.chi_square, 1e-300)
    return float(fdtrc(tested.amplitudes, rest, tested.chi_square / tested.amplitudes / (left / rest)))


def _scan_shares(points: ResidualPoints, residual, carried, part) -> tuple[ScanShare, ...]:
    n, found = len(points), []
    square, left = residual[:n] ** 2, (residual - carried)[:n] ** 2
    for scan in np.unique(points.scan):
        here = points.scan == scan
        first = int(np.argmax(here))
        found.append(
            ScanShare(
                "T" if points.is_transmission[first] else "R",
                float(points.theta_i_deg[first]),
                float(points.wavelength_nm[first]),
                int(here.sum()),
                float(square[here].sum()),
                float(left[here].sum()),
                float(np.sqrt(np.mean(part[here] ** 2))),
            )
        )
    return tuple(found)


def shape_sentence(
    points: ResidualPoints,
    shares: Sequence[ModeShare],
    carried: CarriedShare,
    part: np.ndarray,
    found: Sequence[Asymmetry],
) -> str:
    """One or more sentences; `part` is the relative residual that the modes carry."""
    sentences = [*_mode_sentences(points, shares, carried, part), *map(_broken, found)]
    return " ".join(filter(None, sentences))


def _mode_sentences(points, shares, carried: CarriedShare, part) -> Iterator[str]:
    if not shares or carried.excess <= 0:
        yield "No smooth mode stands out of the noise."
        return
    low = next((o for o in carried.orders if carried.of_order(o) >= _HALF * carried.share), None)
    most = ""
    if low is not None and low.amplitudes < len(shares):
        most = f", the {low.amplitudes} up to order {low.order} alone {100 * carried.of_order(low):.0f} %"
    yield _size(len(shares), carried, most)
    for side, word in _SIDES.items():
        own = [found for found in shares if found.mode.side == side]
        if own:
            yield f"In {word}, {_leading(own[0])}: {_extremes(points, part, points.of_side(side))}."
    yield from _trends(points, part)
    if carried.smooth is None and carried.share < _HALF:
        yield "Most of it varies on a finer scale than these modes, or is confined to few directions."


def _size(n_modes: int, carried: CarriedShare, most: str) -> str:
    """How large the smooth part is, and how much of it the modes carry: all shares are of one whole."""
    several = n_modes > 1
    if carried.smooth is None:
        count = f"{n_modes} of {carried.n_considered} smooth modes carry"
        count = count if several else "One smooth mode carries"
        return f"{count} {100 * carried.share:.0f} % of the chi-square above the noise{most}."
    modes = f"{n_modes} of {carried.n_considered} broad modes" if several else "one broad mode"
    whole, part = round(100 * carried.smooth), round(100 * carried.share)
    finer = f"; the other {whole - part} % on a finer scale, or in few directions" if whole > part else ""
    return (
        f"{whole} % of the chi-square above the noise varies smoothly with direction: {part} % in "
        f"{modes}{most}{finer}."
    )


def _leading(found: ModeShare) -> str:
    """The character of the leading mode."""
    mode = found.mode
    grows = "level" if mode.order == 0 else "growing towards grazing angles"
    if mode.order > 2:
        grows = "changing sign with the polar angle"
    if mode.azimuthal_order is None:
        azimuth = "opposite in the two half-planes" if mode.n % 2 else "alike in both half-planes"
    else:
        azimuth = _AZIMUTH.get(mode.azimuthal_order, f"as cos {mode.azimuthal_order} phi")
    return f"the leading one is {azimuth}, {grows}"


def _extremes(points: ResidualPoints, part: np.ndarray, here: np.ndarray) -> str:
    at = np.flatnonzero(here)
    top, bottom = int(at[np.argmax(part[at])]), int(at[np.argmin(part[at])])
    order = sorted((top, bottom), key=lambda i: -abs(part[i]))
    largest = abs(part[order[0]])
    words = [
        f"measured {'above' if part[i] > 0 else 'below'} the model by up to {_percent(part[i])} at "
        f"{_direction(points, i)}"
        for i in order
        if abs(part[i]) >= _SECOND * largest and (i == top) == (part[i] > 0)
    ]
    return ", ".join(words)


def _percent(value: float) -> str:
    return f"{100 * abs(value):.2g} %"


def _direction(points: ResidualPoints, i: int) -> str:
    return (
        f"incidence {points.theta_i_deg[i]:.3g}°, view {points.theta_o_deg[i]:.3g}°, "
        f"phi {points.phi_deg[i]:.3g}°"
    )


def _trends(points: ResidualPoints, part: np.ndarray) -> Iterator[str]:
    """How the rms changes with incidence and wavelength."""
    for name, values, unit in (
        ("incidence", points.theta_i_deg, "°"),
        ("wavelength", points.wavelength_nm, " nm"),
    ):
        levels = np.unique(values)
        rms = np.array([np.sqrt(np.mean(part[values == level] ** 2)) for level in levels])
        if levels.size < 2 or rms.max() < _DIFFERS * rms.min():
            continue
        most, least = int(np.argmax(rms)), int(np.argmin(rms))
        yield (
            f"Its rms changes with {name}: {_percent(rms[most])} at {levels[most]:g}{unit}, "
            f"{_percent(rms[least])} at {levels[least]:g}{unit}."
        )


def _broken(found: Asymmetry) -> str:
    if not found.is_significant:
        return ""
    what, cause = _CAUSES[found.kind]
    at = f"incidence {found.theta_i_deg:.3g}°, view {found.theta_o_deg:.3g}°, phi {found.phi_deg:.3g}°"
    size = _percent(found.relative_rms)
    return f"Part of it differs between {what} (rms {size} of the mean, most at {at}): {cause}."

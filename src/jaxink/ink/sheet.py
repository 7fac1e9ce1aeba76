"""A table as an infinitely thin sheet between the other layers of its sample.

The sheet only uses the table. Light in the clear layers on either side is represented by basic radiance
L/n^2 on channels of kappa = n sin(theta) and by azimuthal cosine series; the table is interpolated linearly
in its polar angles. Regular light and its first lobes are computed at their own angles, which makes every
direction exact apart from the table; later lobes are averaged over the channels.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError
from jaxink.fitting import FitResult
from jaxink.ink.ink_layers import InkLayers, find_ink
from jaxink.ink.polar_grid import linear_matrix
from jaxink.ink.table import COMPONENTS, InkTable
from jaxink.numerics.quadrature import gauss_legendre_unit
from jaxink.sample import Layer, Sample

# Components by exit side, then side of incidence; side 0 is I, side 1 is A.
_BETWEEN = (("R_II", "T_AI"), ("T_IA", "R_AA"))
# Azimuthal orders of lobes, azimuths from which they are computed, and parts of a channel for averages.
_LOBE_ORDERS, _LOBE_AZIMUTHS, _LOBE_PARTS = 72, 181, 4
# Keeps light that is trapped without loss, which nothing excites, from dividing by zero.
_KEPT = 1 - 1e-12


@dataclasses.dataclass(frozen=True)
class ClearRun:
    """Clear layers between the surroundings and one side of the sheet.

    Parameters
    ----------
    indices
        Refractive indices of the surroundings and of each layer, inwards; the last is on the sheet's side.
    optical_thickness
        Optical thickness of each layer.
    """

    indices: tuple[float, ...]
    optical_thickness: tuple[float, ...]

    def reflected_and_transmitted(self, kappa: Float[np.ndarray, " channels"]):
        """Reflectance towards the sheet, and transmittance (the same in both directions), by n sin(theta)."""
        cosines = [np.sqrt(np.maximum(1 - (kappa / n) ** 2, 0.0)) for n in self.indices]
        reflected, transmitted = np.zeros_like(kappa), (cosines[0] > 0).astype(float)
        for k, thickness in enumerate(self.optical_thickness):
            r = _fresnel(*self.indices[k : k + 2], *cosines[k : k + 2])
            gain = 1 / np.maximum(1 - r * reflected, 1e-12)
            reflected = r + (1 - r) ** 2 * gain * reflected
            transmitted = (1 - r) * gain * transmitted
            inside = cosines[k + 1] > 0
            through = np.where(inside, np.exp(-thickness / np.where(inside, cosines[k + 1], 1.0)), 0.0)
            reflected, transmitted = through**2 * reflected, through * transmitted
        return reflected, transmitted


def _fresnel(index_1, index_2, cosine_1, cosine_2):
    """Unpolarised reflectance, independent of the solver's like the whole verification."""
    s_1, s_2, p_1, p_2 = index_1 * cosine_1, index_2 * cosine_2, index_2 * cosine_1, index_1 * cosine_2
    some = (cosine_1 > 0) | (cosine_2 > 0)
    r_s, r_p = ((a - b) / np.where(some, a + b, 1.0) for a, b in ((s_1, s_2), (p_1, p_2)))
    return (r_s**2 + r_p**2) / 2


def clear_run(
    values: Mapping[str, float], surroundings: str, layers: Sequence[Layer], wavelength: float
) -> ClearRun:
    """Clear layers from the surroundings inwards to the sheet."""

    def get(name):
        return float(values.get(f"{name}@{wavelength:g}", values.get(name)))

    indices = [get(surroundings)] + [get(f"{layer.name}.refractive_index") for layer in layers]
    thickness = [
        get(f"{layer.name}.absorption_per_mm") * get(f"{layer.name}.thickness_mm") for layer in layers
    ]
    return ClearRun(tuple(indices), tuple(thickness))


@dataclasses.dataclass(frozen=True)
class Sheet:
    """A table at one wavelength as a sheet between clear layers.

    Parameters
    ----------
    table
        The table.
    wavelength
        Index of its wavelength.
    runs
        Clear layers on side I and on side A.
    n_nodes
        Streams in each block of kappa between two refractive indices.
    """

    table: InkTable
    wavelength: int
    runs: tuple[ClearRun, ClearRun]
    n_nodes: int = 32

    @property
    def indices(self) -> tuple[float, float]:
        """Refractive indices of side I and side A."""
        return self.runs[0].indices[-1], self.runs[1].indices[-1]

    @cached_property
    def channels(self) -> tuple[np.ndarray, np.ndarray]:
        """Kappa of the channels and weights kappa dkappa, each of shape ``(channels,)``."""
        unit, weight = gauss_legendre_unit(self.n_nodes)
        kappa, etendue = [], []
        for end, top in self._blocks:
            cosine = top * unit
            kappa.append(end * np.sqrt(1 - cosine**2))
            etendue.append(end**2 * top * weight * cosine)
        return np.concatenate(kappa), np.concatenate(etendue)

    @property
    def _blocks(self) -> list[tuple[float, float]]:
        """Refractive index at the end of each block of channels, and the cosine at its start."""
        largest = max(self.indices)
        ends = sorted({n for run in self.runs for n in run.indices if n <= largest})
        return [
            (end, np.sqrt(1 - (start / end) ** 2)) for start, end in zip([0.0, *ends], ends, strict=False)
        ]

    @cached_property
    def _parts(self) -> tuple[np.ndarray, np.ndarray]:
        """Kappa of equal parts of every channel, and their shares of its etendue, ``(channels, parts)``."""
        _, weight = gauss_legendre_unit(self.n_nodes)
        ends = np.concatenate([[0.0], np.cumsum(weight)])
        fractions = (np.arange(_LOBE_PARTS) + 0.5) / _LOBE_PARTS
        unit = ends[:-1, None] + weight[:, None] * fractions
        kappa = [end * np.sqrt(1 - (top * unit) ** 2) for end, top in self._blocks]
        share = unit / unit.sum(axis=1, keepdims=True)
        return np.concatenate(kappa), np.tile(share, (len(kappa), 1))

    def bsdf(
        self, lit_from: int, theta_i_deg: float, theta_o_deg, phi_deg, is_transmission
    ) -> Float[np.ndarray, " points"]:
        """Diffuse BSDF of the whole sample, 1/sr, for directions in the surroundings.

        Parameters
        ----------
        lit_from
            0: light comes from side I; 1: from side A.
        theta_i_deg
            Angle of incidence.
        theta_o_deg, phi_deg, is_transmission
            Exit directions, shape ``(points,)``.
        """
        theta_o_deg, phi_deg = np.asarray(theta_o_deg, float), np.asarray(phi_deg, float)
        leaves = np.where(is_transmission, 1 - lit_from, lit_from)
        outside = np.array([run.indices[0] for run in self.runs])
        kappa_in = np.array([outside[lit_from] * np.sin(np.deg2rad(theta_i_deg))])
        kappa_out = outside[leaves] * np.sin(np.deg2rad(theta_o_deg))
        distinct, position = np.unique(kappa_out, return_inverse=True)
        nodes, _ = self.channels
        at_in, at_out = _Regular(self, kappa_in), _Regular(self, distinct)
        incident = np.zeros((2, 1))
        incident[lit_from] = at_in.transmitted[lit_from]
        # Power that reaches the sheet regularly from either side, after any number of passages.
        arriving = incident + at_in.reflected * at_in.to_and_fro(at_in.pass_sheet(incident))
        first = self._with_lobes((nodes, kappa_in), (self._parts, _whole(kappa_in))) @ arriving.ravel()
        at_nodes, after_any_number = self._multiple
        back = at_nodes.reflected.ravel() * np.einsum("mab,mb->ma", after_any_number, first)
        once = np.zeros((len(first), 2 * len(distinct)))
        smooth = self._scattered((distinct, kappa_in)) @ arriving.ravel()
        once[: len(smooth)] = smooth
        onward = self._with_lobes((distinct, nodes), (_whole(distinct), self._parts))
        more = np.einsum("mab,mb->ma", onward, back * self._weight)
        emerging = at_out.to_and_fro((once + more).reshape(-1, 2, len(distinct)))
        orders = np.arange(len(emerging))
        cosines = np.where(orders == 0, 1.0, 2.0) * np.cos(orders * np.deg2rad(180 - phi_deg)[:, None])
        smooth = np.einsum("pm,mop->op", cosines, emerging[:, :, position])
        lobes = np.einsum("oip,i->op", self._lobes(kappa_out, kappa_in, phi_deg), arriving[:, 0])
        at_points = _Regular(self, kappa_out)
        radiance = at_points.transmitted * (smooth + at_points.to_and_fro(lobes))
        return (outside[:, None] ** 2 * radiance)[leaves, np.arange(len(leaves))]

    @cached_property
    def _weight(self) -> np.ndarray:
        """Etendue of the channels on both sides, including the full circle of azimuths."""
        return 2 * np.pi * np.tile(self.channels[1], 2)

    @cached_property
    def _multiple(self):
        """Regular light at the channels, and the matrix from once-scattered light to all orders."""
        nodes, _ = self.channels
        at_nodes = _Regular(self, nodes)
        straight = np.block([[np.diag(at_nodes.sheet[o, i]) for i in range(2)] for o in range(2)])
        between = self._with_lobes((nodes, nodes), (_whole(nodes), _whole(nodes)))
        step = between * self._weight + straight
        returned = _KEPT * at_nodes.reflected.ravel()
        return at_nodes, np.linalg.inv(np.eye(2 * len(nodes)) - step * returned)

    @cached_property
    def _series(self) -> np.ndarray:
        """Cosine series of f / n_o^2 without lobes, shape ``(4, orders, incidences, outgoing)``."""
        table = self.table
        n_phi = 1 + round(180 / np.min(np.diff(table.phi_deg)))
        from_forward = linear_matrix(table.phi_deg, np.linspace(180.0, 0.0, n_phi))
        values = np.einsum("ciop,kp->ckio", table.rest_per_sr[:, self.wavelength], from_forward)
        series = _cosine_series(values, axis=1)
        leaving = np.array([self.indices["IA".index(name[3])] for name in COMPONENTS])
        return series / leaving[:, None, None, None] ** 2

    def _scattered(self, kappas) -> np.ndarray:
        """Kernel from either side to either side, shape ``(orders, 2 * outgoing, 2 * incoming)``."""
        out, into = kappas
        blocks = []
        for o, row in enumerate(_BETWEEN):
            rows = []
            for i, name in enumerate(row):
                coefficients = self._series[COMPONENTS.index(name)]
                to, source = self._reading(out, o), self._reading(into, i)
                rows.append(np.einsum("oa,mba,ib->moi", to, coefficients, source, optimize=True))
            blocks.append(np.concatenate(rows, axis=2))
        return np.concatenate(blocks, axis=1)

    def _with_lobes(self, kappas, parts) -> np.ndarray:
        """As `_scattered`, with lobes averaged over the parts of the exit and incident channels."""
        kernel = self._scattered(kappas)
        if self.table.lobes is None:
            return kernel
        (out, out_share), (into, in_share) = parts
        phi = np.linspace(180.0, 0.0, _LOBE_AZIMUTHS)[:, None, None, None, None]
        lobes = self._lobes(out[:, :, None, None], into, phi)
        averaged = np.einsum("oikapbq,ap,bq->koaib", lobes, out_share, in_share, optimize=True)
        series = _cosine_series(averaged, axis=0).reshape(_LOBE_AZIMUTHS, *kernel.shape[1:])
        n_orders = max(len(kernel), _LOBE_ORDERS)
        missing = ((0, n_orders - len(kernel)), (0, 0), (0, 0))
        return np.pad(kernel, missing) + series[:n_orders]

    def _lobes(self, kappa_out, kappa_in, phi_deg) -> np.ndarray:
        """Lobes over n_o^2 by exit side and side of incidence, for directions that broadcast."""
        shape = np.broadcast_shapes(*(np.shape(axis) for axis in (kappa_out, kappa_in, phi_deg)))
        found = np.zeros((2, 2, *shape))
        if self.table.lobes is None:
            return found
        for o, row in enumerate(_BETWEEN):
            for i, name in enumerate(row):
                sines = kappa_in / self.indices[i], kappa_out / self.indices[o]
                theta_i, theta_o = (np.rad2deg(np.arcsin(np.minimum(sine, 1.0))) for sine in sines)
                lobes = self.table.lobes_at(name, theta_i, theta_o, phi_deg, self.wavelength)
                there = (sines[0] < 1) & (sines[1] < 1)
                found[o, i] = np.where(there, lobes / self.indices[o] ** 2, 0.0)
        return found

    def _reading(self, kappa, side):
        """Matrix that reads the table at the angles of channels on a side; 0 for evanescent channels."""
        sine = kappa / self.indices[side]
        rows = linear_matrix(self.table.theta_deg, np.rad2deg(np.arcsin(np.minimum(sine, 1.0))))
        return np.where((sine < 1)[:, None], rows, 0.0)

    def regular(self, kappa) -> np.ndarray:
        """Regular power by exit side and side of incidence, shape ``(2, 2, channels)``."""
        table = self.table.regular[:, self.wavelength]
        return np.array(
            [
                [self._reading(kappa, i) @ table[COMPONENTS.index(name)] for i, name in enumerate(row)]
                for row in _BETWEEN
            ]
        )


def _whole(kappa: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Channels with one part each."""
    return kappa[:, None], np.ones((len(kappa), 1))


def _cosine_series(values: np.ndarray, axis: int) -> np.ndarray:
    """Coefficients of a function of azimuth, given at equal steps from 0 to 180 degrees."""
    from scipy.fft import dct

    series = np.moveaxis(dct(values, type=1, axis=axis), axis, 0) / (2 * (values.shape[axis] - 1))
    series[-1] /= 2
    return np.moveaxis(series, 0, axis)


class _Regular:
    """Regular light at given channels: in the sheet, and reflected and transmitted by the runs."""

    def __init__(self, sheet: Sheet, kappa: np.ndarray):
        self.sheet = sheet.regular(kappa)
        pairs = [run.reflected_and_transmitted(kappa) for run in sheet.runs]
        self.reflected, self.transmitted = (np.stack(part) for part in zip(*pairs, strict=True))

    def pass_sheet(self, arriving):
        """Regular light that leaves the sheet, from the light that arrives, shape ``(2, channels)``."""
        return np.einsum("oik,ik->ok", self.sheet, arriving)

    def to_and_fro(self, leaving):
        """Light that leaves the sheet, including all later regular passages, ``(..., 2, channels)``."""
        again = np.moveaxis(self.sheet * self.reflected, 2, 0)
        light = np.moveaxis(leaving, -1, 0)[..., None]
        steps = (np.eye(2) - again).reshape(len(again), *(1,) * (light.ndim - 3), 2, 2)
        return np.moveaxis(np.linalg.solve(steps, light)[..., 0], 0, -1)


def sheets(table: InkTable, source: FitResult | Sample, n_nodes: int = 32) -> tuple[InkLayers, list[Sheet]]:
    """Put a table in the place of its ink.

    Parameters
    ----------
    table
        From `ink_table`; its attributes name the layers and the side of the plate.
    source
        The sample.
    n_nodes
        As for `Sheet`.

    Returns
    -------
    ink, sheets
        The ink's layers, and the sheet at each wavelength of the table.

    Raises
    ------
    InputRefusedError
        If the table does not belong to this sample, or other layers scatter or are rough.
    """
    sample = source.sample if isinstance(source, FitResult) else source
    names = str(table.attrs.get("layers", "")).split() or None
    ink = find_ink(sample, names, table.attrs.get("inside"))
    runs = []
    for before in (True, False):
        outer = sample.layers[: ink.first] if before else sample.layers[: ink.last : -1]
        for layer in outer:
            if layer.scatters:
                raise InputRefusedError(
                    f"layer '{layer.name}' beside the ink scatters; a sheet needs clear layers around it."
                )
            if layer.roughness:
                raise InputRefusedError(
                    f"layer '{layer.name}' beside the ink is rough; a sheet needs smooth layers around it."
                )
        runs.append(("front" if before else "back", outer))
    values = sample.parameters.values_with({})
    found = []
    for w, wavelength in enumerate(table.wavelength_nm):
        here = [clear_run(values, f"surroundings.index_{side}", outer, wavelength) for side, outer in runs]
        inside, outside = here if ink.inside == "front" else here[::-1]
        sides = (inside, table.index_inside[w], "I"), (outside, table.index_outside[w], "A")
        for run, index, side in sides:
            if abs(run.indices[-1] / index - 1) > 1e-9:
                raise InputRefusedError(
                    f"side {side} of the table has the refractive index {index:g}, but the sample has "
                    f"{run.indices[-1]:g} there; compute the table for that index."
                )
        found.append(Sheet(table, w, (inside, outside), n_nodes))
    return ink, found

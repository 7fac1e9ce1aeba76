"""Plane elements joined by the star product, on directions of their own: no table, no solver of jaxink.

Light is followed as basic radiance L / n^2 by kappa = n sin(theta) and by the azimuthal order. Channels are
those of a quadrature, and directions to look at, which carry no weight. An operator consists of a kernel
between channels and of regular light, which stays in its channel.
"""

import dataclasses

import numpy as np
from scipy.fft import dct

# Keeps light that is trapped without loss, which nothing excites, from dividing by zero.
_KEPT = 1 - 1e-12


@dataclasses.dataclass(frozen=True)
class Channels:
    """Directions in every medium, by kappa.

    Parameters
    ----------
    ends
        Ascending refractive indices; a block of Gaussian channels lies between each and the one before.
    exact
        Kappa of the directions to look at, all below the first of ``ends``.
    n_nodes
        Channels of each block.
    n_parts
        Equal parts of a channel, over which narrow lobes are averaged.
    """

    ends: tuple[float, ...]
    exact: np.ndarray
    n_nodes: int = 32
    n_parts: int = 4

    @property
    def _blocks(self):
        """End of each block, and its cosines there: at nodes, at parts, and weights."""
        node, weight = np.polynomial.legendre.leggauss(self.n_nodes)
        node, weight = (node + 1) / 2, weight / 2
        edges = np.concatenate([[0.0], np.cumsum(weight)])
        parts = edges[:-1, None] + weight[:, None] * (np.arange(self.n_parts) + 0.5) / self.n_parts
        for start, end in zip((0.0, *self.ends), self.ends, strict=False):
            top = np.sqrt(1 - (start / end) ** 2)
            yield end, top * node, top * parts, top * weight

    @property
    def kappa(self) -> np.ndarray:
        """Quadrature first, then the exact directions."""
        nodes = [end * np.sqrt(1 - cosine**2) for end, cosine, _, _ in self._blocks]
        return np.concatenate([*nodes, self.exact])

    @property
    def weight(self) -> np.ndarray:
        """2 pi kappa dkappa, 0 for the exact directions."""
        nodes = [2 * np.pi * end**2 * cosine * step for end, cosine, _, step in self._blocks]
        return np.concatenate([*nodes, np.zeros(len(self.exact))])

    @property
    def parts(self) -> tuple[np.ndarray, np.ndarray]:
        """Kappa of all parts, ``(parts,)``, and the matrix that averages over them, ``(channels, parts)``."""
        kappa, shares = [], []
        for end, _, cosine, _ in self._blocks:
            kappa.append(end * np.sqrt(1 - cosine**2))
            shares.append(cosine / cosine.sum(axis=1, keepdims=True))
        share = np.concatenate(shares)
        whole = np.zeros((len(self.kappa), share.size + len(self.exact)))
        rows = np.repeat(np.arange(len(share)), self.n_parts)
        whole[rows, np.arange(share.size)] = share.ravel()
        at = np.arange(len(self.exact))
        whole[len(share) + at, share.size + at] = 1.0
        return np.concatenate([np.concatenate(kappa).ravel(), self.exact]), whole

    def cosine(self, index: float) -> np.ndarray:
        """Cosines in a medium, 0 where light is evanescent."""
        return np.sqrt(np.maximum(1 - (self.kappa / index) ** 2, 0.0))


@dataclasses.dataclass(frozen=True)
class Operator:
    """From light along the channels to light along the channels.

    Parameters
    ----------
    kernel
        By azimuthal order, outgoing and incident channel; its first orders, if others are 0.
    regular
        Share that stays in its channel.
    weight
        Of the channels.
    """

    kernel: np.ndarray
    regular: np.ndarray
    weight: np.ndarray

    def __matmul__(self, first: "Operator") -> "Operator":
        n = min(len(self.kernel), len(first.kernel))
        kernel = _sum(
            (self.kernel[:n] * self.weight) @ first.kernel[:n],
            self.kernel * first.regular,
            self.regular[:, None] * first.kernel,
        )
        return Operator(kernel, self.regular * first.regular, self.weight)

    def __add__(self, other: "Operator") -> "Operator":
        return Operator(_sum(self.kernel, other.kernel), self.regular + other.regular, self.weight)

    @property
    def repeated(self) -> "Operator":
        """1 / (1 - operator): light that returns any number of times."""
        gain = 1 / (1 - _KEPT * self.regular)
        kernel = gain[:, None] * self.kernel
        step = np.eye(len(self.weight)) - kernel * self.weight
        return Operator(np.linalg.solve(step, kernel * gain), gain, self.weight)


def _sum(*kernels: np.ndarray) -> np.ndarray:
    total = np.zeros((max(map(len, kernels)), *kernels[0].shape[1:]))
    for kernel in kernels:
        total[: len(kernel)] += kernel
    return total


@dataclasses.dataclass(frozen=True)
class Last:
    """A plane element with nothing below: reflection of light from above, and transmission down."""

    above: Operator
    down: Operator


@dataclasses.dataclass(frozen=True)
class Element(Last):
    """A plane element: also reflection of light from below, and transmission up."""

    below: Operator
    up: Operator

    def on(self, other: "Element") -> "Element":
        """The element on top of another, with a medium between them in which light travels freely."""
        first, to_this = self.lit_on(other), (other.above @ self.below).repeated @ other.up
        return Element(
            first.above,
            first.down,
            other.below + other.down @ self.below @ to_this,
            self.up @ to_this,
        )

    def lit_on(self, other: Last) -> Last:
        """The same for light from above."""
        to_other = (self.below @ other.above).repeated @ self.down
        return Last(self.above + self.up @ (other.above @ to_other), other.down @ to_other)


def smooth_face(channels: Channels, above: float, below: float) -> Element:
    """A smooth face between two media."""
    cosines = channels.cosine(above), channels.cosine(below)
    both = (cosines[0] > 0) & (cosines[1] > 0)
    s, p = (
        ((a - b) / np.where(both, a + b, 1.0)) ** 2
        for a, b in (
            (above * cosines[0], below * cosines[1]),
            (below * cosines[0], above * cosines[1]),
        )
    )
    reflected, none = np.where(both, (s + p) / 2, 1.0), np.zeros((1, len(both), len(both)))
    turned = Operator(none, reflected, channels.weight)
    through = Operator(none, np.where(both, 1 - reflected, 0.0), channels.weight)
    return Element(turned, through, turned, through)


def series(values: np.ndarray) -> np.ndarray:
    """Cosine series along the first axis, of values at equal azimuths from straight on to straight back."""
    coefficients = dct(values, type=1, axis=0) / (2 * (len(values) - 1))
    coefficients[-1] /= 2
    return coefficients


def summed(kernel: np.ndarray, azimuth_rad: np.ndarray) -> np.ndarray:
    """Sum of the series of pairs, ``(orders, pairs)``, at their azimuths from straight on."""
    orders = np.arange(len(kernel))[:, None]
    return np.sum(np.where(orders == 0, 1.0, 2.0) * kernel * np.cos(orders * azimuth_rad), axis=0)

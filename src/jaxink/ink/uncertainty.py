"""Propagation of a fit's covariance to the entries of a table."""

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

if TYPE_CHECKING:
    from jaxink.fitting import FitResult


def determined(rows: Sequence[Any]) -> tuple[list[int], list[str], list[str]]:
    """Positions of the parameters with a standard error, names of those at a bound, and of all others.

    ``rows`` have name, standard error and flag of `jaxink.fitting.result.FittedParameter`.
    """
    silent = [p for p in rows if p.standard_error is None]
    held = [p.name for p in silent if p.flag in ("at lower bound", "at upper bound")]
    lost = [p.name for p in silent if p.name not in held]
    return [i for i, p in enumerate(rows) if p.standard_error is not None], held, lost


@dataclasses.dataclass(frozen=True)
class ParameterCovariance:
    """Covariance of the parameters that have a standard error.

    Parameters
    ----------
    names, matrix
        Parameters and their covariance in their own units; empty if there are no standard errors.
    sentence
        Explanation for users of the table.
    """

    names: tuple[str, ...]
    matrix: Float[np.ndarray, "parameters parameters"]
    sentence: str

    @property
    def known(self) -> bool:
        """Whether there are standard errors."""
        return bool(self.names)

    @classmethod
    def none(cls, why: str) -> "ParameterCovariance":
        """No standard errors, with the reason."""
        return cls((), np.zeros((0, 0)), f"no standard errors: {why}")

    @classmethod
    def of(cls, result: "FitResult") -> "ParameterCovariance":
        """Covariance of a fit; a parameter at its bound is treated as known.

        There is none if the fit says that its standard errors are meaningless.
        """
        if not result.verdict.standard_errors_hold:
            return cls.none("those of the fit are meaningless")
        rows = [result[name] for name in result.correlation_names]
        _, held, lost = determined(rows)
        if lost:
            return cls.none(f"the fit does not determine {', '.join(lost)}")
        found = result.covariance
        if not found.names:
            return cls.none("the fit has none")
        sentence = "standard errors from the fit's covariance"
        if held:
            sentence += f"; {', '.join(held)} at its bound is treated as known"
        return cls(found.names, found.matrix, sentence)

    def standard_error(self, slopes: Float[np.ndarray, "parameters *shape"]) -> Float[np.ndarray, "*shape"]:
        """Standard error of quantities with these derivatives by the parameters."""
        variance = np.einsum("p...,pq,q...->...", slopes, self.matrix, slopes, optimize=True)
        return np.sqrt(np.maximum(variance, 0.0))

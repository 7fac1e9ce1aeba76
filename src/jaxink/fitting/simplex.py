"""Fit by scipy's Nelder-Mead simplex, with the same objective, scaling and start: the baseline."""

import time
from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize

from jaxink.fitting.objective import Objective
from jaxink.fitting.outcome import Outcome, Search
from jaxink.fitting.programs import program_of
from jaxink.numerics.weak_cache import WeakCache


@WeakCache
def _loss_program(residual):
    def loss(arrays, unit):
        rows, predicted = residual(arrays, unit)
        return jnp.sum(rows**2), predicted

    return jax.jit(loss)


class SimplexSearch:
    """Nelder-Mead on one objective.

    Parameters
    ----------
    objective
        To be minimised.
    max_evaluations
        Limit of one search.
    relative_tolerance
        Stops when the values of the simplex agree to this share of the best one, and its corners to 1e-4 of
        the ranges.
    """

    def __init__(self, objective: Objective, max_evaluations: int = 2000, relative_tolerance: float = 1e-8):
        residual, arrays = program_of(objective)
        self._loss = partial(_loss_program(residual), arrays)
        self.max_evaluations = max_evaluations
        self.relative_tolerance = relative_tolerance
        self.compile_seconds = 0.0

    def run(self, start: np.ndarray, progress: Callable[[int, float], None] | None = None) -> Search:
        """Search from one start; without a Jacobian, hence without standard errors.

        Parameters
        ----------
        start
            Free parameters scaled to [0, 1].
        progress
            Called after each iteration with its number and the best loss.

        References
        ----------
        Gao, Han 2012 Comput. Optim. Appl. 51, 259 (scipy's implementation with bounds).
        """
        if not self.compile_seconds:
            began = time.perf_counter()
            jax.block_until_ready(self._loss(jnp.asarray(start)))
            self.compile_seconds = time.perf_counter() - began
        loss_start = float(self._loss(jnp.asarray(start))[0])
        path: list[float] = []

        def iteration(intermediate_result):
            path.append(float(intermediate_result.fun))
            if progress is not None:
                progress(len(path), path[-1])

        began = time.perf_counter()
        found = self._minimised(start, loss_start, iteration)
        seconds = time.perf_counter() - began
        loss, predicted = self._loss(jnp.asarray(found.x))
        return Search(
            method="simplex",
            outcome=Outcome.CONVERGED if found.success else Outcome.MAX_STEPS,
            start=np.asarray(start),
            unit=np.asarray(found.x),
            loss_start=loss_start,
            loss=float(loss),
            jacobians=0,
            evaluations=int(found.nfev),
            run_seconds=seconds,
            compile_seconds=self.compile_seconds,
            decrement=float("nan"),
            triangle=None,
            gradient=None,
            predicted=np.asarray(predicted),
            path=tuple(path),
        )

    def _minimised(self, start: np.ndarray, loss_start: float, iteration: Callable):
        def function(unit):
            loss = float(self._loss(jnp.asarray(unit))[0])
            return loss if np.isfinite(loss) else 1e300

        return minimize(
            function,
            start,
            method="Nelder-Mead",
            bounds=[(0.0, 1.0)] * len(start),
            callback=iteration,
            options={
                "maxfev": self.max_evaluations,
                "xatol": 1e-4,
                "fatol": self.relative_tolerance * max(loss_start, 1e-300),
                "adaptive": len(start) > 4,
            },
        )

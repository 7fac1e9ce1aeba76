"""Methods of scipy, all with bounds, on the same objective, variables and start as jaxink's own."""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from jaxink.fitting.compiled import Point
from jaxink.fitting.method import WithJacobian, WithoutDerivatives
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.watched import WatchedObjective

# Resolution of the variables, as a share of their ranges, at which a method without derivatives ends.
_RESOLUTION = 1e-4
# Radius of the first steps and at the end, of the methods that have one, as a share of the ranges.
_FIRST_RADIUS, _LAST_RADIUS = 0.25, 1e-6
# Relative tolerance on the loss, of the first loss.
_RELATIVE = 1e-8
# Tolerances of the methods with derivatives: they end where rounding ends their progress.
_TIGHT = 1e-14


class ScipyMinimize(WithoutDerivatives):
    """A method of `scipy.optimize.minimize` without derivatives."""

    scipy_name: ClassVar[str]
    scipy_options: ClassVar[Mapping[str, Any]]

    def options_for(self, loss_start: float, n: int) -> Mapping[str, Any]:
        """Options of scipy for the first loss and ``n`` parameters."""
        del loss_start, n
        return self.scipy_options

    def descend(self, watched: WatchedObjective, start: Float[np.ndarray, " parameters"]) -> Outcome:
        """Search from a start."""
        from scipy import optimize

        loss_start = watched.loss(start)

        def step(*_):
            watched.step()

        found = optimize.minimize(
            watched.loss,
            start,
            method=self.scipy_name,
            bounds=optimize.Bounds(watched.lower, watched.upper),
            callback=step,
            options=dict(self.options_for(max(loss_start, 1e-300), len(start))),
        )
        return Outcome.CONVERGED if found.success else Outcome.STALLED


class Simplex(ScipyMinimize):
    """Nelder-Mead: the baseline (Gao, Han 2012 Comput. Optim. Appl. 51, 259; scipy's, with bounds)."""

    name, title, scipy_name = "simplex", "simplex", "Nelder-Mead"

    def options_for(self, loss_start: float, n: int) -> Mapping[str, Any]:
        """Ends when the values agree to a share of the first one, and the corners to one of the ranges."""
        return {
            "maxfev": np.inf,
            "maxiter": np.inf,
            "xatol": _RESOLUTION,
            "fatol": _RELATIVE * loss_start,
            "adaptive": n > 4,
        }


class Powell(ScipyMinimize):
    """Powell's conjugate directions."""

    name, title, scipy_name = "powell", "Powell method", "Powell"
    scipy_options: ClassVar = {"maxfev": np.inf, "maxiter": np.inf, "xtol": _RESOLUTION, "ftol": _RELATIVE}


class Cobyla(ScipyMinimize):
    """COBYLA: linear models in a trust region. It may step outside the box; points are clipped to it."""

    name, title, scipy_name = "cobyla", "COBYLA method", "COBYLA"
    scipy_options: ClassVar = {"rhobeg": _FIRST_RADIUS, "tol": _LAST_RADIUS, "maxiter": 10**6}


class Cobyqa(ScipyMinimize):
    """COBYQA: quadratic models in a trust region."""

    name, title, scipy_name = "cobyqa", "COBYQA method", "COBYQA"
    scipy_options: ClassVar = {
        "initial_tr_radius": _FIRST_RADIUS,
        "final_tr_radius": _LAST_RADIUS,
        "maxfev": 10**6,
        "maxiter": 10**6,
    }


class DifferentialEvolution(WithoutDerivatives):
    """Differential evolution: a population from a Latin hypercube, one member of which is the start."""

    name, title = "differential_evolution", "differential evolution"

    def descend(self, watched: WatchedObjective, start: Float[np.ndarray, " parameters"]) -> Outcome:
        """Search from a start."""
        from scipy import optimize

        found = optimize.differential_evolution(
            watched.loss,
            optimize.Bounds(watched.lower, watched.upper),
            x0=start,
            rng=self.seed,
            maxiter=10**6,
            tol=1e-6,
            polish=False,
            callback=lambda *_, **__: watched.step(),
        )
        return Outcome.CONVERGED if found.success else Outcome.STALLED


class LimitedMemoryBfgs(WithJacobian):
    """L-BFGS-B, with the exact gradient 2 J^T r of the loss, relative to the first loss."""

    name, title = "l_bfgs_b", "L-BFGS-B method"

    def descend(self, watched: WatchedObjective, start: Float[np.ndarray, " parameters"]) -> Outcome:
        """Search from a start."""
        from scipy import optimize

        scale = max(watched.linearised(start).loss, 1e-300)

        def loss(unit):
            point = watched.linearised(unit)
            assert point.jacobian is not None
            return point.loss / scale, 2 * point.jacobian.T @ point.residual / scale

        optimize.minimize(
            loss,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=optimize.Bounds(watched.lower, watched.upper),
            callback=lambda *_: watched.step(),
            options={"maxfun": 10**6, "maxiter": 10**6, "ftol": _TIGHT, "gtol": _TIGHT},
        )
        # Judged by the first-order conditions.
        return Outcome.STALLED


class LeastSquares(WithJacobian):
    """A method of `scipy.optimize.least_squares`, with the exact Jacobian."""

    def descend(self, watched: WatchedObjective, start: Float[np.ndarray, " parameters"]) -> Outcome:
        """Search from a start."""
        from scipy import optimize

        last: list[Point] = []

        def linearised(unit):
            # The residual and the Jacobian are asked for separately; a trial point is one Jacobian, as it is
            # for jaxink's own method.
            if not last or not np.array_equal(last[-1].unit, unit):
                last[:] = [watched.linearised(unit)]
                watched.step()
            return last[-1]

        optimize.least_squares(
            lambda unit: linearised(unit).residual,
            start,
            jac=lambda unit: linearised(unit).jacobian,
            bounds=(watched.lower, watched.upper),
            method=self.name,
            x_scale="jac",
            ftol=_TIGHT,
            xtol=_TIGHT,
            gtol=_TIGHT,
            max_nfev=10**6,
        )
        # Judged by the first-order conditions.
        return Outcome.STALLED


class TrustRegionReflective(LeastSquares):
    """Trust region reflective."""

    name, title = "trf", "trust-region reflective method"


class Dogbox(LeastSquares):
    """Dogleg steps in a rectangular trust region."""

    name, title = "dogbox", "dogbox method"

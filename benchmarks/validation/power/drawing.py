"""Data sets drawn from a case with an effect, and screens of them."""

import dataclasses

import numpy as np

import jaxink
from benchmarks.validation.power.cases import ACCURACY, case_of
from jaxink.diagnosis import ScreenOptions, prepare_screen
from jaxink.diagnosis.search.candidate_refits import limit_by_refits
from jaxink.diagnosis.search.model import fit_model
from jaxink.diagnosis.search.problem import SearchProblem
from jaxink.diagnosis.search.screen import Screen
from jaxink.effects import CATALOGUE, Scene
from jaxink.fitting import prepare_data
from jaxink.measurement import noise_of
from jaxink.solver.accuracy import DEFAULT_ACCURACY
from jaxink.solver.config import SolverConfig

# Relative difference between what a refit leaves of an effect and what the screen says, up to which one
# screen, made at the fit to the case, serves all data sets; beyond, every data set has one of its own, as in
# a diagnosis.
SERVED = 0.2


class Case:
    """One measurement as the pattern of directions, sample and noise."""

    def __init__(self, name: str):
        data, self.sample = case_of(name)
        self.data = prepare_data(data, self.sample)
        used = self.data.used
        scene = Scene.of(*(c[used] for c in self.data.directions), self.data.row[used])
        accuracy = ACCURACY.get(name, DEFAULT_ACCURACY)
        result = jaxink.fit(self.data, self.sample, jaxink.FitOptions(profile="none", accuracy=accuracy))
        noise = noise_of(self.data, self.sample.noise)
        self.problem = SearchProblem(
            self.sample,
            self.data,
            noise,
            SolverConfig(**result.solver),
            scene,
            CATALOGUE,
            ScreenOptions(),
            accuracy,
        )
        self.relative, self.floor = self.sample.noise.relative, self.sample.noise.floor_per_sr
        self.model = fit_model(self.problem, (), result.values)
        made = Screen.of(self.model)
        self.directions, self.candidates = made.directions, made.candidates
        self.prepared = prepare_screen(
            self.model.jacobian, self.candidates, at_bound=self.model.at_bound, options=ScreenOptions()
        )
        self.screened = self.prepared.screen(self.model.residual)
        self._limits: dict[str, float] = {}

    def drawn(self, predicted, rng):
        """Measured values for a true BSDF."""
        of = self.model.objective.objective
        common = of.scan_relative * rng.standard_normal(of.n_scans)[of.scan]
        independent = np.hypot(self.relative * predicted, self.floor) * rng.standard_normal(predicted.size)
        return predicted * (1 + common) + independent

    def measured_as(self, values) -> jaxink.GonioData:
        """The measurement with other values at its used points."""
        bsdf = self.data.bsdf_per_sr.copy()
        bsdf[self.data.used] = values
        return self.data.replace(bsdf_per_sr=bsdf)

    def follows(self, name, predicted, factor) -> bool:
        """Whether fits follow an effect so far that the screen, made at their start, misjudges the rest."""
        direction, limit = self.limit(name)
        fitted = self.model.objective.fit_near(self.model.linearised, measured=predicted)
        linear = (factor * limit * self.length(direction.column)) ** 2
        return abs(fitted.chi_square / linear - 1) > SERVED

    def own_screens(self, predicted, count, rng):
        """Screens of data sets drawn around a true BSDF, each made where the fit to it ended."""
        for _ in range(count):
            problem = dataclasses.replace(self.problem, data=self.measured_as(self.drawn(predicted, rng)))
            yield Screen.of(fit_model(problem, (), self.model.solution.values)).result

    def residuals(self, predicted, count, rng):
        """Whitened residuals of refits to data sets drawn around a true BSDF."""
        objective, found = self.model.objective, []
        for _ in range(count):
            objective.replace_measured(self.drawn(predicted, rng))
            solution = objective.fit(self.model.solution.values, self.model.free)
            left = objective.measured - solution.predicted_per_sr
            found.append(objective.whiten(solution.predicted_per_sr, left))
        return np.array(found)

    def limit(self, name):
        """The direction in which least of an effect is seen, and its detection limit, as a report has it."""
        row = self.screened[name]
        inner = int(np.nanargmin(row.detection_limits))
        direction = self.directions[name][inner]
        if name not in self._limits:
            linear = float(row.detection_limits[inner])
            self._limits[name] = limit_by_refits(self.model, direction, linear, row.critical_z)
        return direction, self._limits[name]

    def at_strength(self, name, factor):
        """True BSDF with an effect at a multiple of its detection limit where it is least, and the direction.

        Where the screen's strength is a share of the area that is like a setting, which the effect itself
        does not know, its own strength is taken at which the free parameters leave as much; where already the
        least of its range leaves more, that share of the area.
        """
        direction, limit = self.limit(name)
        effect = direction.effect
        term, here = effect.strength, direction.setting.get(effect.strength.name)
        objective = self.model.objectives.of(effect)
        values = self.model.solution.values | {t.name: t.value for t in effect.terms} | direction.setting

        def at(strength):
            return objective.predict(values | {term.name: strength})

        if here is None or effect.scales:
            step = factor * limit * (1.0 if here is None else here - effect.neutral)
            return (at(effect.neutral + step) if step <= term.maximum - effect.neutral else None), direction
        base = self.model.solution.predicted_per_sr
        wanted = factor * limit * self.length(direction.column)
        end = max(effect.neutral, term.minimum)

        def left(predicted):
            return self.length(self.model.objective.whiten(base, predicted - base))

        if left(at(end)) > wanted:
            return base + factor * limit * (at(here) - base), direction
        low, high = np.log([end, here]) if term.scale == "log" else (end, here)
        for _ in range(12):
            middle = (low + high) / 2
            predicted = at(float(np.exp(middle)) if term.scale == "log" else middle)
            if left(predicted) < wanted:
                low = middle
            else:
                high = middle
        return predicted, direction

    def length(self, column) -> float:
        """Length of what the free parameters cannot imitate of a change."""
        return float(np.linalg.norm(self.model.projection.remove(column)))

    def screens(self, residuals):
        """The case's own screen of some residuals."""
        adjusted = self.prepared.p_values(residuals).adjusted
        for residual, p in zip(residuals, adjusted, strict=True):
            if np.nanmin(p) <= self.problem.screen_options.level:
                yield self.prepared.screen(residual)

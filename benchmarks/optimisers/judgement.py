"""What the kept searches of one problem say."""

import dataclasses
import statistics
from collections.abc import Callable, Iterator

import numpy as np

from jaxink.fitting.comparison_methods import METHODS

# Of intervals: 95 %.
_NORMAL_QUANTILE = 1.959964
# A search has reached the best known minimum if its loss is within this share of the best one.
WITHIN = 0.01
_SAME = 1e-6


@dataclasses.dataclass(frozen=True)
class Variant:
    """A method, alone or after a scan."""

    method: str
    scan: bool

    @property
    def title(self) -> str:
        """Its name in tables."""
        return f"{self.method}, after the scan" if self.scan else self.method


@dataclasses.dataclass(frozen=True)
class Judged:
    """One problem with its kept searches.

    Parameters
    ----------
    name, kind
        Problem and kind of objective.
    rows, n
        Number of residuals and of parameters.
    searches
        Kept lines by variant and start.
    times
        Milliseconds of an evaluation and of a Jacobian; see `benchmarks.optimisers.times`.
    """

    name: str
    kind: str
    rows: int
    n: int
    searches: dict[Variant, dict[int, dict]]
    times: dict[str, float]

    @classmethod
    def of(
        cls, name: str, kind: str, rows: int, n: int, lines: list[dict], times: dict[str, float]
    ) -> "Judged":
        """From the lines of a problem."""
        found: dict[Variant, dict[int, dict]] = {}
        for method in METHODS:
            for scan in (False, True):
                of_variant = [x for x in lines if x["method"] == method and x.get("scan") is scan]
                if of_variant:
                    found[Variant(method, scan)] = {x["start"]: x for x in of_variant}
        return cls(name, kind, rows, n, found, times)

    @property
    def best(self) -> dict:
        """The search with the lowest loss of all."""
        every = (line for lines in self.searches.values() for line in lines.values())
        return min((line for line in every if line["loss"] is not None), key=lambda line: line["loss"])

    @property
    def target(self) -> float:
        """Loss at which the best known minimum counts as reached."""
        return (1 + WITHIN) * self.best["loss"]

    @property
    def default(self) -> Variant:
        """What `jaxink.fit` does by default: a scan comes first if a radius is free."""
        after = Variant("gradient", True)
        return after if after in self.searches else Variant("gradient", False)

    def rms(self, loss: float) -> float:
        """Root mean square residual: an RMSD, or in standard deviations of the noise."""
        return float(np.sqrt(loss / self.rows)) if self.kind == "chi_square" else float(np.sqrt(loss))

    def rms_words(self, loss: float) -> str:
        """The same with its unit."""
        value = self.rms(loss)
        return {
            "chi_square": f"{value:.4f} sigma",
            "absolute": f"{value:.4g} /sr",
            "relative": f"{100 * value:.4g} %",
            "logarithmic": f"{100 * value:.4g} %",
        }[self.kind]

    def share(self, variant: Variant) -> tuple[int, int]:
        """Number of starts that reached the best known minimum, and of all."""
        lines = self.searches[variant].values()
        return sum(line["loss"] is not None and line["loss"] <= self.target for line in lines), len(lines)

    def median(self, variant: Variant, of: Callable[[dict], float | None]) -> float | None:
        """Median over the starts."""
        known = [value for line in self.searches[variant].values() if (value := of(line)) is not None]
        return statistics.median(known) if known else None

    def parameter_error(self, line: dict) -> float | None:
        """Largest distance of a parameter from the best minimum, in its standard errors there.

        Of an objective other than chi-square, the standard errors are those that its misfit would cause.
        """
        deviation = self._deviation()
        if line["loss"] is None or deviation is None:
            return None
        known = np.isfinite(deviation) & (deviation > 0)
        distance = np.abs(np.array(line["unit"]) - np.array(self.best["unit"]))[known] / deviation[known]
        return float(np.max(distance, initial=0.0))

    def _deviation(self) -> np.ndarray | None:
        with_errors = [
            line
            for lines in self.searches.values()
            for line in lines.values()
            if line["deviation"] is not None and line["loss"] is not None
        ]
        if not with_errors:
            return None
        best = min(with_errors, key=lambda line: line["loss"])
        deviation = np.array([np.nan if d is None else d for d in best["deviation"]])
        if self.kind != "chi_square":
            deviation = deviation * np.sqrt(best["loss"] / max(self.rows - self.n, 1))
        return deviation

    def time_ms(self, entry: list) -> float:
        """Time of the evaluations and Jacobians up to an entry of a path."""
        return entry[0] * self.times["evaluation_ms"] + entry[1] * self.times["jacobian_ms"]

    def seconds(self, line: dict) -> float:
        """The same of a whole search, in seconds."""
        return self.time_ms([line["evaluations"], line["jacobians"]]) / 1000

    def cost(self, entry: list) -> float:
        """Evaluations up to an entry of a path, a Jacobian counting as much as one by differences."""
        return entry[0] + (self.n + 1) * entry[1]

    def speed_up(self, measure: Callable[[list], float]) -> list[float]:
        """How many times less than the simplex alone the default takes to the simplex's own final loss.

        By start; 0 where it does not reach it.
        """
        default, simplex = self.searches[self.default], self.searches.get(Variant("simplex", False), {})
        found = []
        for start in default.keys() & simplex.keys():
            end = simplex[start]["path"][-1]
            reached = effort_at(default[start], end[3] * (1 + _SAME), measure)
            found.append(0.0 if reached is None else measure(end) / max(reached, 1e-9))
        return found

    def efforts(self, variant: Variant, measure: Callable[[list], float]) -> Iterator[float]:
        """Effort up to the best known minimum by start; infinite where it was not reached."""
        for line in self.searches[variant].values():
            reached = effort_at(line, self.target, measure)
            yield np.inf if reached is None else reached


def wilson(reached: int, of: int) -> tuple[float, float]:
    """Wilson's 95 % interval of the probability behind a share.

    References
    ----------
    Wilson 1927 J. Am. Stat. Assoc. 22, 209.
    """
    z, share = _NORMAL_QUANTILE, reached / of
    middle = (share + z**2 / (2 * of)) / (1 + z**2 / of)
    half = z / (1 + z**2 / of) * np.sqrt(share * (1 - share) / of + z**2 / (4 * of**2))
    return max(float(middle - half), 0.0), min(float(middle + half), 1.0)


def share_words(reached: int, of: int) -> str:
    """A share with its interval, such as ``3 of 20 (5-36 %)``."""
    low, high = wilson(reached, of)
    return f"{reached} of {of} ({100 * low:.0f}-{100 * high:.0f} %)"


def effort_at(line: dict, loss: float, measure: Callable[[list], float]) -> float | None:
    """Effort at which a search reached a loss; None if it did not."""
    return next((measure(entry) for entry in line["path"] if entry[3] is not None and entry[3] <= loss), None)

"""Distinct minima that the searches of a fit have found, and what the data say of each."""

import dataclasses
from collections.abc import Iterator, Sequence

from jaxink.display.brief import brief_repr, counted
from jaxink.display.card import CardTable
from jaxink.numerics.digits import rounded

# Of chi-square, with the noise scaled: three standard errors away from the best minimum.
COMPARABLE_RISE = 9.0
_MOST_SHOWN, _MOST_COLUMNS, _LEAST_WEIGHT = 8, 5, 1e-6
# What the column of that name contains.
OVER_MINIMA = (
    "over minima: range of the values at all minima that the data do not exclude; a standard error knows of "
    "one minimum only."
)


@dataclasses.dataclass(frozen=True)
class Minimum:
    """One of the minima.

    Parameters
    ----------
    values
        Free parameters by name.
    loss
        Value of the objective: chi-square, or the mean square of its RMSD.
    rise
        How much higher than the best one: the difference in loss divided by `Minima.noise_scale`.
    weight
        exp(-rise / 2), divided by the sum over all minima.
    starts
        Number of starts from which the search ended here.
    is_searched
        False if a scan has only passed by: the values are the best ones with the scanned parameter held at
        one of the values of the scan, and the minimum itself is lower.
    """

    values: dict[str, float]
    loss: float
    rise: float
    weight: float
    starts: int
    is_searched: bool

    __repr__ = brief_repr


@dataclasses.dataclass(frozen=True)
class Minima:
    """All of them, the fit's own first, the others by their loss.

    Parameters
    ----------
    starts
        Number of starts: that of the sample, and random ones.
    unfinished
        From how many of these the search did not end in a minimum.
    noise_scale
        Difference in loss that stands for one unit of chi-square: chi-square per degree of freedom at the
        best minimum, at least 1; for another objective, the loss there per degree of freedom.
    left_out
        Number of higher minima that are not kept.
    found
        The minima.
    """

    starts: int
    unfinished: int
    noise_scale: float
    left_out: int
    found: tuple[Minimum, ...]

    __repr__ = brief_repr

    @property
    def comparable(self) -> tuple[Minimum, ...]:
        """Minima that the data do not exclude: less than three standard errors above the best one."""
        return tuple(one for one in self.found if one.rise < COMPARABLE_RISE)

    def spread(self, name: str) -> tuple[float, float] | None:
        """Range of a free parameter over the comparable minima; None if there is only one."""
        values = [one.values[name] for one in self.comparable]
        return (min(values), max(values)) if len(values) > 1 else None

    @property
    def is_told(self) -> bool:
        """Whether there is more to tell than that one start led to one minimum."""
        return self.starts > 1 or len(self.found) > 1

    @property
    def sentence(self) -> str:
        """How many starts ended where."""
        best, others = self.found[0].starts, [one for one in self.found[1:] if one.starts]
        if self.starts == 1:
            ended = "this minimum, too" if best else "no minimum" if self.unfinished else "another minimum"
            return f"The start alone leads to {ended}; the scan has found the others in the table."
        words = f"{best} of {counted(self.starts, 'start')} ended in the minimum of this fit"
        elsewhere = self.starts - best - self.unfinished
        if elsewhere:
            several = len(others) + self.left_out
            words += f", {elsewhere} in {'another one' if several == 1 else f'{several} others'}"
        if self.unfinished:
            words += f", {self.unfinished} in none"
        return f"{words}."

    def rivals(self, is_chi_square: bool) -> Iterator[str]:
        """A sentence on each other minimum that the data do not exclude.

        Parameters
        ----------
        is_chi_square
            Whether the loss is chi-square.
        """
        for one in self.comparable[1:]:
            at = ", ".join(f"{name} = {value:.5g}" for name, value in one.values.items())
            raw, most = one.loss - self.found[0].loss, "only" if one.is_searched else "at most"
            if is_chi_square:
                height = f"is {most} {raw:.2g} higher in chi-square"
                if self.noise_scale > 1:
                    height += f" ({one.rise:.2g} with the noise scaled to the misfit)"
            else:
                height = f"has a misfit that is {most} {100 * raw / self.found[0].loss:.2g} % higher"
            yield f"Another minimum {height}, at {at}; the data hardly distinguish the two."

    def table(self) -> CardTable:
        """The lowest minima, with the parameters that differ most among them."""
        shown = self.found[:_MOST_SHOWN]
        names = self._telling(shown)
        heads = ["minimum", "misfit", "above this fit", "weight", "starts", *names]
        rows = [
            [
                "this fit" if not i else "searched" if one.is_searched else "passed by the scan",
                ("" if one.is_searched else "< ") + rounded(one.loss, 6),
                rounded(one.rise) if i else "",
                f"{one.weight:.2g}" if one.weight > _LEAST_WEIGHT else f"< {_LEAST_WEIGHT:g}",
                str(one.starts),
                *(rounded(one.values[name], 5) for name in names),
            ]
            for i, one in enumerate(shown)
        ]
        return CardTable(heads, rows, title="Minima")

    def _telling(self, shown: Sequence[Minimum]) -> list[str]:
        """Names of the parameters that differ most, in their order."""
        names = list(self.found[0].values)

        def difference(name):
            values = [one.values[name] for one in shown]
            return (max(values) - min(values)) / (max(map(abs, values)) or 1.0)

        chosen = sorted(names, key=difference, reverse=True)[:_MOST_COLUMNS]
        return [name for name in names if name in chosen]

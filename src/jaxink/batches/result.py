"""The outcome of a batch: its rows in the order of the plan, and their colours."""

import dataclasses
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jaxink.batches.listing import POSITION, ListedMeasurement
from jaxink.batches.row import Row, RowOutcome
from jaxink.batches.verdicts import is_misfit, verdict_meaning, what_to_do
from jaxink.colour import difference
from jaxink.display.brief import counted
from jaxink.display.card import Card, CardTable, Presented
from jaxink.errors import InputRefusedError, JaxinkError

if TYPE_CHECKING:
    import pandas


# What a row rests on, in the column `state` of the summary.
CURRENT, KEPT = "current", "input missing or refused now; the earlier result is kept"
SUMMARY_CSV, SUMMARY_PARQUET, REPORT_PAGE = "summary.csv", "summary.parquet", "report.html"
_MOST_SHOWN = 10


@dataclasses.dataclass(frozen=True, repr=False)
class Batch(Presented):
    """The outcome of a batch.

    Parameters
    ----------
    title
        Of the plan.
    rows
        One for each measurement, in the order of the plan; of a batch that was cut off, those that there are.
    measurements
        What the plan says of each of them.
    folder
        Where everything is written.
    kept
        Number of rows that were there before and have the same inputs.
    again
        For each row that was there and was done again, the reason.
    absent
        For each row whose result is kept although its measurement is missing or refused now, what is wrong.
    others
        Number of rows in the folder that belong to an earlier plan.
    reading
        Keywords of `jaxink.read` for the files of each.
    missing
        Number of measurements of the plan without a row, because the batch was cut off.
    """

    title: str
    rows: tuple[Row, ...]
    measurements: tuple[ListedMeasurement, ...]
    folder: Path
    kept: int = 0
    again: tuple[str, ...] = ()
    absent: Mapping[str, str] = dataclasses.field(default_factory=dict)
    others: int = 0
    missing: int = 0
    reading: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    @property
    def outcomes(self) -> Counter[str]:
        """Number of measurements by outcome."""
        return Counter(str(row.outcome) for row in self.rows)

    @property
    def verdicts(self) -> Counter[str]:
        """Number of results by verdict."""
        return Counter(row.verdict for row in self.rows if row.verdict is not None)

    @property
    def trouble(self) -> tuple[Row, ...]:
        """Rows that have no result, or one that did not converge."""
        return tuple(row for row in self.rows if row.ended is not RowOutcome.DONE)

    @property
    def misfits(self) -> tuple[Row, ...]:
        """Rows with a result that converged, but whose model does not fit the measurement."""
        return tuple(row for row in self.rows if row.ended is RowOutcome.DONE and is_misfit(row))

    @property
    def parameters(self) -> dict[str, str]:
        """Free parameters of all rows and their units."""
        return {p.name: p.unit for row in self.rows for p in row.parameters}

    def columns(self) -> dict[str, list[Any]]:
        """The summary: one entry for each measurement, by the names of its columns; None is unknown."""
        rows, listed = self.rows, self.measurements
        head: dict[str, list[Any]] = {
            "name": [row.name for row in rows],
            "file": ["|".join(row.files) for row in rows],
            "outcome": [str(row.outcome) for row in rows],
            "state": [KEPT if row.name in self.absent else CURRENT for row in rows],
            "verdict": [row.verdict for row in rows],
            "sentence": [row.sentence for row in rows],
        }
        places = [key for key in POSITION if any(key in one.columns for one in listed)]
        others = dict.fromkeys(key for one in listed for key in one.columns if key not in places)
        given = {key: [one.columns.get(key) for one in listed] for key in (*places, *others)}
        stated = dict.fromkeys(key for one in listed for key in one.values)
        given |= {f"given_{key}": [one.values.get(key) for one in listed] for key in stated}
        found: dict[str, list[Any]] = {}
        for name in self.parameters:
            each = [next((p for p in row.parameters if p.name == name), None) for row in rows]
            found[name] = [None if p is None else p.value for p in each]
            found[f"{name}_se"] = [None if p is None else p.standard_error for p in each]
            found[f"{name}_flag"] = [None if p is None else p.flag for p in each]
        found |= colour_columns(rows)
        tail: dict[str, list[Any]] = {
            "effects": [", ".join(row.effects) for row in rows],
            "points": [row.points for row in rows],
            "chi_square": [row.chi_square for row in rows],
            "reduced_chi_square": [row.reduced_chi_square for row in rows],
            "seconds": [row.seconds for row in rows],
            "attempts": [row.attempts for row in rows],
            "host": [row.host for row in rows],
            "finished": [row.finished for row in rows],
            "page": [row.page for row in rows],
        }
        return {**head, **{key: given[key] for key in given if key not in head}, **found, **tail}

    def to_frame(self) -> "pandas.DataFrame":
        """The summary as a pandas DataFrame, indexed by the names of the measurements."""
        import pandas

        return pandas.DataFrame(self.columns()).set_index("name")

    def card(self) -> Card:
        """How many ended in which way, and the first rows with trouble."""
        n_rows = counted(len(self.rows), "measurement")
        lines = [f"{n_rows}, {self.kept} of them done before; in {self.folder}."]
        lines += [
            f"{n} {code.replace('_', ' ')}: {RowOutcome[code.upper()].meaning}."
            for code, n in self.outcomes.items()
        ]
        lines += [
            f"{n} {code.replace('_', ' ')}: {verdict_meaning(code)}."
            for code, n in self.verdicts.most_common()
            if code not in self.outcomes
        ]
        if self.missing:
            without = f"{counted(self.missing, 'measurement')} {'has' if self.missing == 1 else 'have'}"
            lines.append(f"{without} no row yet; the same command goes on with the rest.")
        if self.absent:
            lines.append(f"{len(self.absent)} of the {len(self.rows)}: {KEPT}.")
        if self.others:
            lines.append(
                f"{counted(self.others, 'row')} of measurements that the plan does not find now: kept in the "
                "folder, and not listed."
            )
        rows = [[row.name, row.outcome.replace("_", " "), row.sentence] for row in self.trouble[:_MOST_SHOWN]]
        more = len(self.trouble) - len(rows)
        remarks = [f"... and {more} more with trouble, see {SUMMARY_CSV}."] if more > 0 else []
        tables = [CardTable(["measurement", "outcome", "sentence"], rows, (0, 1, 2))]
        misfits = [[row.name, (row.verdict or "").replace("_", " "), row.sentence] for row in self.misfits]
        tables.append(CardTable(["measurement", "verdict", "sentence"], misfits[:_MOST_SHOWN], (0, 1, 2)))
        if len(misfits) > _MOST_SHOWN:
            remarks.append(f"... and {len(misfits) - _MOST_SHOWN} more that the model does not fit.")
        absent = [[name, sentence] for name, sentence in self.absent.items()]
        tables.append(
            CardTable(["measurement", "input missing or refused now"], absent[:_MOST_SHOWN], (0, 1))
        )
        if len(absent) > _MOST_SHOWN:
            remarks.append(f"... and {len(absent) - _MOST_SHOWN} more whose input is missing or refused.")
        if misfits:
            sentences, command = what_to_do(self.misfits[0], str(self.folder), self.reading)
            # In a table, which keeps the command on one line.
            tables.append(CardTable(["what to do"], [[line] for line in (*sentences, command) if line]))
        return Card(f"Batch: {self.title}", lines, tables, remarks)


class UnfinishedBatchError(JaxinkError):
    """A batch was cut off from its workers.

    Parameters
    ----------
    why
        What happened.
    found
        What there is, which has been written.
    """

    def __init__(self, why: str, found: Batch):
        n_all = len(found) + found.missing
        super().__init__(
            f"{why.rstrip('.')}; {len(found)} of {n_all} measurements have a row in {found.folder}, and the "
            "same command goes on with the others once a scheduler runs."
        )
        self.found = found


def colour_columns(rows: Sequence[Row]) -> dict[str, list[Any]]:
    """CIELAB of each row, and its CIEDE2000 to the first one that has a colour; no column if none has.

    A colour in another direction or light than that of the first has no difference.
    """
    first = next((row.colour for row in rows if row.colour is not None), None)
    if first is None:
        return {}
    colours = [row.colour for row in rows]
    columns: dict[str, list[Any]] = {
        f"lab_{name}": [None if one is None else getattr(one, name) for one in colours] for name in "Lab"
    }
    differences: list[float | None] = []
    for one in colours:
        same = one is not None and (one.direction, one.light) == (first.direction, first.light)
        if not same or one is None:
            differences.append(None)
            continue
        labs = (np.array([c.L, c.a, c.b]) for c in (one, first))
        try:
            differences.append(float(difference(*labs)))
        except InputRefusedError:
            # The rows are of a machine with colour-science, which this one lacks.
            differences.append(None)
    return columns | {"ciede2000_to_first": differences}

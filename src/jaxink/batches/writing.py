"""Writes the summary and the report of a batch."""

import csv
from contextlib import suppress
from typing import Any

from jaxink.batches.page import report_page
from jaxink.batches.result import REPORT_PAGE, SUMMARY_CSV, SUMMARY_PARQUET, Batch
from jaxink.files.spreadsheet import cell
from jaxink.files.writing import written_whole


def write_batch(batch: Batch) -> None:
    """Write ``summary.csv``, ``summary.parquet`` if pandas and pyarrow are installed, and ``report.html``.

    Raises
    ------
    InputRefusedError
        If one of them cannot be written.
    """
    columns = batch.columns()
    with (
        written_whole(batch.folder / SUMMARY_CSV) as part,
        open(part, "w", encoding="utf-8", newline="") as file,
    ):
        table = csv.writer(file)
        table.writerow(map(cell, columns))
        table.writerows(map(_cells, zip(*columns.values(), strict=True)))
    (batch.folder / SUMMARY_PARQUET).unlink(missing_ok=True)
    with suppress(ImportError):
        import pyarrow  # noqa: F401

        frame = batch.to_frame()
        with written_whole(batch.folder / SUMMARY_PARQUET) as part:
            frame.to_parquet(part)
    with written_whole(batch.folder / REPORT_PAGE) as part:
        part.write_text(report_page(batch), encoding="utf-8")


def _cells(values: tuple[Any, ...]) -> list[Any]:
    return ["" if v is None else repr(v) if isinstance(v, float) else cell(v) for v in values]

"""Many measurements of one kind of sample: a plan, workers, and a folder that a stopped batch goes on from.

Layers from below: `listing`, `row`, `task`, `answer` (what there is to do, and what comes back; no JAX),
`measure` (the work on one measurement, a pure function), `child` (the process that does it within limits),
`on_dask` (many of them), `folder` (what is kept), `run` (all together).
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jaxink.batches.plan import Plan, load_plan
    from jaxink.batches.result import REPORT_PAGE, SUMMARY_CSV, Batch, UnfinishedBatchError
    from jaxink.batches.row import Row, RowOutcome
    from jaxink.batches.run import batch

_HOMES = {
    "jaxink.batches.plan": (
        "Plan",
        "load_plan",
    ),
    "jaxink.batches.result": (
        "Batch",
        "REPORT_PAGE",
        "SUMMARY_CSV",
        "UnfinishedBatchError",
    ),
    "jaxink.batches.row": (
        "Row",
        "RowOutcome",
    ),
    "jaxink.batches.run": ("batch",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'jaxink.batches' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__

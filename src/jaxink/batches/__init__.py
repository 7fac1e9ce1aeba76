"""Many measurements of one kind of sample: a plan, workers, and a folder that a stopped batch goes on from.

Layers from below: `listing`, `row`, `task`, `answer` (what there is to do, and what comes back; no JAX),
`measure` (the work on one measurement, a pure function), `child` (the process that does it within limits),
`on_dask` (many of them), `folder` (what is kept), `run` (all together).
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jaxink.batches.plan import Plan, load_plan
    from jaxink.batches.result import Batch, UnfinishedBatchError
    from jaxink.batches.row import Row, RowOutcome
    from jaxink.batches.run import batch

# The workers of a scheduler import this room, and leave JAX to the processes that compute.
_HOMES = {
    "Batch": "result",
    "Plan": "plan",
    "Row": "row",
    "RowOutcome": "row",
    "UnfinishedBatchError": "result",
    "batch": "run",
    "load_plan": "plan",
}

__all__ = ["Batch", "Plan", "Row", "RowOutcome", "UnfinishedBatchError", "batch", "load_plan"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'jaxink.batches' has no attribute {name!r}")
    return getattr(import_module(f"jaxink.batches.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return __all__

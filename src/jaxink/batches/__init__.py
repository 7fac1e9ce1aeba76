"""Many measurements of one kind of sample: a plan, workers, and a folder that a stopped batch goes on from.

Layers from below: `listing`, `row`, `task`, `answer` (what there is to do, and what comes back; no JAX),
`measure` (the work on one measurement, a pure function), `child` (the process that does it within limits),
`on_dask` (many of them), `folder` (what is kept), `run` (all together).
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

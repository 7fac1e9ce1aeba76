"""The process of a worker: it answers one task after the other; ``python -m jaxink.batches.child_main``.

Tasks arrive on the standard input and answers leave by the standard output, both pickled; what else is
printed goes to the standard error. The process ends when its input ends, and when the process that has
started it is gone.
"""

import os
import pickle
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from typing import Any

from jaxink.numerics.program_store import share_cache_with_jax

_LOOK_S = 1.0
# Linux ends this process rather than others if the machine runs out of memory.
_OOM_SCORE = "500"


def main() -> None:
    """Answer until the input ends; the argument names the function, as ``module:function``."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    threading.Thread(target=_end_with_parent, args=(os.getppid(),), daemon=True).start()
    with suppress(OSError), open("/proc/self/oom_score_adj", "w", encoding="ascii") as file:
        file.write(_OOM_SCORE)
    function = named(sys.argv[1])
    if "jax" in sys.modules:
        share_cache_with_jax()
    _answer(answers, "ready")
    while True:
        try:
            task = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        _answer(answers, function(task))


def named(function: str) -> Callable[[Any], Any]:
    """The function of a name such as ``module:function``."""
    module, name = function.split(":")
    return getattr(import_module(module), name)


def _answer(stream, what: object) -> None:
    pickle.dump(what, stream, protocol=pickle.HIGHEST_PROTOCOL)
    stream.flush()


def _end_with_parent(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_LOOK_S)
    os._exit(1)


if __name__ == "__main__":
    main()

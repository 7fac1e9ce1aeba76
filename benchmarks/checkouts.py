"""A module of the benchmarks in a process of its own, with the jaxink of any checkout."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from benchmarks.pages import REPOSITORY

_MARK = "line "


def started(
    checkout: Path, module: str, *words: object, variables: Mapping[str, str] | None = None
) -> subprocess.Popen[str]:
    """Start a module of this repository with the package of a checkout; its input and output are pipes.

    Parameters
    ----------
    checkout
        Its ``src`` comes first.
    module
        Name of the module.
    words
        On its command line.
    variables
        Of its environment, besides those of this process.
    """
    path = f"{checkout / 'src'}{os.pathsep}{REPOSITORY}"
    return subprocess.Popen(
        [sys.executable, "-m", module, *map(str, words)],
        env={**os.environ, **(variables or {}), "PYTHONPATH": path},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=REPOSITORY,
    )


def tell(line: dict) -> None:
    """Print what `told` collects."""
    print(_MARK + json.dumps(line), flush=True)


def told(checkout: Path, module: str, *words: object) -> list[dict]:
    """What a module tells with the package of a checkout.

    Raises
    ------
    subprocess.CalledProcessError
        The module failed.
    """
    with started(checkout, module, *words) as process:
        text, _ = process.communicate()
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, process.args)
    return [json.loads(line.removeprefix(_MARK)) for line in text.splitlines() if line.startswith(_MARK)]

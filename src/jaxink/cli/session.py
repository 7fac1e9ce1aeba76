"""What surrounds a command: one sentence for each failure, progress, and the compilation cache."""

import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from enum import IntEnum
from pathlib import Path
from typing import NoReturn

import typer

from jaxink.errors import InputRefusedError, JaxinkError
from jaxink.numerics.progress import Progress

DEBUG_VARIABLE = "JAXINK_DEBUG"
# XLA writes its log to stderr from this level on: 3 is what ends the process, 1 what JAX sets if nobody does.
_LOG_LEVEL, _FATAL_ONLY, _JAX_OWN = "TF_CPP_MIN_LOG_LEVEL", "3", "1"


class ExitCode(IntEnum):
    """How a command ended."""

    FITTED = 0
    FAILED = 1
    UNEXPLAINED = 3
    NOT_CONVERGED = 4
    REFUSED = 5
    INTERRUPTED = 130


@contextmanager
def one_sentence(debug: bool = False) -> Iterator[None]:
    """Turn every failure into one sentence on stderr and an exit code.

    Parameters
    ----------
    debug
        Show the traceback of an unexpected error; also by the environment variable ``JAXINK_DEBUG``.
    """
    debug = debug or bool(os.environ.get(DEBUG_VARIABLE))
    try:
        with warnings.catch_warnings():
            if not debug:
                warnings.simplefilter("ignore")
            yield
    except InputRefusedError as problem:
        _fail(str(problem), ExitCode.REFUSED)
    except JaxinkError as problem:
        _fail(str(problem), ExitCode.FAILED)
    except KeyboardInterrupt:
        _fail("interrupted.", ExitCode.INTERRUPTED)
    except (typer.Exit, BrokenPipeError):
        raise
    except MemoryError as problem:
        _fail(f"there is not enough memory ({' '.join(str(problem).split())[:200]}).", ExitCode.FAILED)
    except Exception as problem:
        if debug:
            raise
        what = " ".join(str(problem).split())[:200]
        _fail(
            f"stopped by an unexpected error ({type(problem).__name__}: {what}); set {DEBUG_VARIABLE}=1 to "
            "see where, and please report it.",
            ExitCode.FAILED,
        )


def _fail(sentence: str, code: ExitCode) -> NoReturn:
    typer.echo(f"jaxink: {sentence}", err=True)
    raise typer.Exit(code)


@contextmanager
def progress(quiet: bool = False) -> Iterator[Progress | None]:
    """A line on stderr that follows a fit; None where stderr is no terminal.

    Parameters
    ----------
    quiet
        Show nothing.
    """
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console

    console = Console(stderr=True, markup=False, highlight=False)
    with console.status("compiling ...", refresh_per_second=4) as status:
        yield lambda what, step, loss: status.update(f"{what}: step {step}, misfit {loss:.6g}")


def silence_xla() -> None:
    """Keep XLA's log off the terminal, in the process of the command alone: a host program's log is its own.

    Loading a stored program logs a warning, on some processors an error, of tuning flags that the loader does
    not know; what truly fails is raised. A level that the user asks for stands.
    """
    if "jaxlib" not in sys.modules:
        os.environ.setdefault(_LOG_LEVEL, _FATAL_ONLY)
        return
    # JAX has read the variable when it was imported, hears of it no more, and has set one that was not set.
    if os.environ.get(_LOG_LEVEL) == _JAX_OWN:
        with suppress(ImportError, AttributeError):
            from jaxlib import utils

            utils.absl_set_min_log_level(int(_FATAL_ONLY))


def prepare_jax() -> None:
    """Import JAX, with its compiled programs kept from one command to the next."""
    import jax

    chosen: str | None = jax.config.values["jax_compilation_cache_dir"]
    folder = None if chosen else _cache_folder()
    if folder is not None:
        jax.config.update("jax_compilation_cache_dir", str(folder))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


def _cache_folder() -> Path | None:
    """The user's cache folder, None where it cannot be written."""
    try:
        root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        folder = Path(root) / "jaxink"
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        return None
    return folder if os.access(folder, os.W_OK | os.X_OK) else None


def installed_version() -> str:
    """Version of the installed package."""
    from importlib.metadata import version

    return version("jaxink")

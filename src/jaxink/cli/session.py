"""Error messages, progress display and compilation cache of the commands."""

import dataclasses
import os
import shlex
import sys
import threading
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from enum import IntEnum
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import typer

from jaxink.cli.progress_lines import ProgressLines
from jaxink.errors import InputRefusedError, JaxinkError, NotConvergedError
from jaxink.numerics.failures import Failures
from jaxink.numerics.program_store import FATAL_ONLY, JAX_LOG_LEVEL, LOG_LEVEL, limit_xla_log
from jaxink.numerics.progress import Progress

DEBUG_VARIABLE = "JAXINK_DEBUG"


class ExitCode(IntEnum):
    """Outcome of a command."""

    FITTED = 0
    FAILED = 1
    UNEXPLAINED = 3
    NOT_CONVERGED = 4
    REFUSED = 5
    UNFINISHED = 6
    INTERRUPTED = 130


class AdvisedError(InputRefusedError):
    """Invalid input, with whole commands that would work.

    Parameters
    ----------
    sentence
        What is wrong.
    commands
        For each command, what it would do, and the command itself.
    """

    code = ExitCode.REFUSED

    def __init__(self, sentence: str, commands: Sequence[tuple[str, str]]):
        super().__init__(sentence)
        self.commands = tuple(commands)


class StoppedError(AdvisedError):
    """Questions that the user ended, with the command that goes on."""

    code = ExitCode.INTERRUPTED


def program() -> str:
    """The program as it was called: a virtual environment need not be on the path."""
    return sys.argv[0] if Path(sys.argv[0]).stem == "jaxink" else "jaxink"


@dataclasses.dataclass(frozen=True)
class CommandLine:
    """A command as it was given, to be repeated with other options.

    Parameters
    ----------
    name
        Command after ``jaxink``.
    arguments
        Positional arguments.
    options
        Value of each option by its name, such as ``--out``; True for one without a value, and None or False
        for one that was not given.
    """

    name: str
    arguments: Sequence[object]
    options: Mapping[str, Any]

    def changed(self, changes: Mapping[str, Any]) -> str:
        """The whole command, quoted, with some options changed or added."""
        words = [program(), self.name, *map(str, self.arguments)]
        for option, value in {**self.options, **changes}.items():
            if value is None or value is False:
                continue
            values = [""] if value is True else value if isinstance(value, list | tuple) else [value]
            words += [word for one in values for word in (option, str(one)) if word]
        return shlex.join(words)


@contextmanager
def one_sentence(debug: bool = False) -> Iterator[None]:
    """Turn every failure into one sentence on stderr and an exit code; commands that would work follow it.

    ``debug``, or the environment variable ``JAXINK_DEBUG``, shows the traceback of an unexpected error.
    """
    debug = debug or bool(os.environ.get(DEBUG_VARIABLE))
    try:
        with warnings.catch_warnings():
            if not debug:
                warnings.simplefilter("ignore")
            yield
    except AdvisedError as problem:
        advice = (f"\n{what}:\n  {command}" for what, command in problem.commands)
        _fail("".join([str(problem), *advice]), problem.code)
    except NotConvergedError as problem:
        _fail(str(problem), ExitCode.NOT_CONVERGED)
    except InputRefusedError as problem:
        _fail(str(problem), ExitCode.REFUSED)
    except JaxinkError as problem:
        _fail(str(problem), ExitCode.FAILED)
    except KeyboardInterrupt:
        _fail("interrupted.", ExitCode.INTERRUPTED)
    except (typer.Exit, BrokenPipeError):
        raise
    except MemoryError as problem:
        _fail(f"not enough memory ({' '.join(str(problem).split())[:200]}).", ExitCode.FAILED)
    except Exception as problem:
        if debug:
            raise
        what = " ".join(str(problem).split())[:200]
        _fail(
            f"unexpected error ({type(problem).__name__}: {what}); set {DEBUG_VARIABLE}=1 to see the "
            "traceback, and please report it.",
            ExitCode.FAILED,
        )


def show_failures(failures: Failures) -> None:
    """Say on stderr which parts failed."""
    for failure in failures.found:
        typer.echo(f"jaxink: {failure.sentence}", err=True)


def _fail(sentence: str, code: ExitCode) -> NoReturn:
    typer.echo(f"jaxink: {sentence}", err=True)
    raise typer.Exit(code)


@contextmanager
def progress(quiet: bool = False) -> Iterator[Progress | None]:
    """A bar on stderr that follows a computation, or lines if it is not a terminal; None if quiet."""
    if quiet:
        yield None
        return
    if not sys.stderr.isatty():
        with ProgressLines(partial(typer.echo, err=True)) as lines:
            yield lines
        return
    from jaxink.cli.progress_bar import ProgressBar

    with ProgressBar() as bar:
        yield bar


def silence_xla() -> None:
    """Keep XLA's log off the terminal; only in the command's own process, never in a host program.

    Loading a cached program logs warnings, on some processors errors, about tuning flags that the loader does
    not know; real failures are raised. A level set by the user is respected.
    """
    if "jaxlib" not in sys.modules:
        # A program that has imported JAX hands its level on to the commands that it starts.
        if os.environ.get(LOG_LEVEL, JAX_LOG_LEVEL) == JAX_LOG_LEVEL:
            os.environ[LOG_LEVEL] = str(FATAL_ONLY)
        return
    # JAX is imported already: it has read the variable, or set it if it was not set.
    if os.environ.get(LOG_LEVEL) == JAX_LOG_LEVEL:
        limit_xla_log(FATAL_ONLY)


def draw_to_files() -> None:
    """Have matplotlib draw to files only; in the command's own process, before matplotlib is imported.

    A command that a notebook starts inherits the notebook's backend, which need not be installed here.
    """
    os.environ["MPLBACKEND"] = "agg"


def prepare_jax() -> None:
    """Import JAX and keep its compiled programs on disk between commands."""
    from jaxink.numerics.program_store import share_cache_with_jax

    share_cache_with_jax()


def import_meanwhile(*modules: str) -> None:
    """Import modules that will be needed, in another thread, while this one waits for XLA."""

    def work():
        # What is wrong with a module, whatever it raises, is said where it is needed.
        with suppress(Exception):
            for module in modules:
                import_module(module)

    threading.Thread(target=work, daemon=True).start()

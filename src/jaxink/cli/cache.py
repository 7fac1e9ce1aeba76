"""``jaxink cache``: the stored programs."""

from jaxink.cli.fit_tables import console
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.numerics.program_store import LARGEST_BYTES, clear_store, stored, why_not_stored

ACTIONS = ("info", "clear")


def run_cache(action: str) -> ExitCode:
    """Say what the store of compiled programs contains, or empty it."""
    if action not in ACTIONS:
        raise InputRefusedError(f"there is no 'cache {action}'; use info or clear.")
    problem = why_not_stored()
    if problem is not None:
        raise InputRefusedError(problem)
    before = stored()
    if action == "clear":
        left = clear_store()
        text = f"removed {before.files - left.files} files, {_megabytes(before.size_bytes - left.size_bytes)}"
    else:
        text = f"{before.files} files, {_megabytes(before.size_bytes)} of at most {_megabytes(LARGEST_BYTES)}"
    console().print(f"Compiled programs in {before.folder}: {text}.", soft_wrap=True)
    return ExitCode.FITTED


def _megabytes(size_bytes: int) -> str:
    return f"{size_bytes / 1e6:.3g} MB" if size_bytes < 1e9 else f"{size_bytes / 1e9:.3g} GB"

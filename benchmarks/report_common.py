"""Shared by the report scripts: where the data are, and how a page is written."""

import os
import platform
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
SAMPLES = REPOSITORY / "benchmarks" / "samples"


def data_folder(kind: str) -> Path:
    """Folder of the measured, simulated or reference data.

    Parameters
    ----------
    kind
        ``measured``, ``simulated`` or ``reference``.

    Returns
    -------
    Path
        Below the folder that the environment variable JAXINK_DATA names, else beside the repository.

    Raises
    ------
    SystemExit
        With a sentence, if it is absent.
    """
    root = Path(os.environ.get("JAXINK_DATA", REPOSITORY.parent / "shared" / "data"))
    folder = root / kind
    if not folder.is_dir():
        raise SystemExit(f"the {kind} data are absent; set JAXINK_DATA to the folder that holds '{kind}'.")
    return folder


def machine() -> str:
    """One line on the machine and the versions."""
    from importlib.metadata import version

    import jax

    device = jax.devices()[0]
    versions = ", ".join(f"{name} {version(name)}" for name in ("jax", "jaxlib", "optimistix", "numpy"))
    return (
        f"{os.cpu_count()} cores, {platform.machine()}, {device.platform}, Python {platform.python_version()}, "
        f"{versions}"
    )


def table(header: list[str], rows: list[list[str]]) -> str:
    """Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def write_page(name: str, text: str) -> None:
    """Write a page of the documentation whole."""
    target = REPOSITORY / "docs" / name
    temporary = target.with_suffix(".tmp")
    temporary.write_text(text.rstrip() + "\n", encoding="utf-8")
    temporary.replace(target)
    print(f"wrote {target.relative_to(REPOSITORY)}")

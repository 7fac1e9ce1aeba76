"""Shared by the scripts: where the data are, how numbers are printed, and how a page is written."""

import os
import platform
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parents[1]


def data_folder(kind: str) -> Path:
    """Folder of the ``measured``, ``simulated`` or ``reference`` data.

    It lies below the folder that the environment variable JAXINK_DATA names, else beside the repository.
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
    python = f"Python {platform.python_version()}"
    return f"{os.cpu_count()} cores, {platform.machine()}, {device.platform}, {python}, {versions}"


def rms(values) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def filled(template: Path, **parts) -> str:
    """Text of a template, its fields in braces filled in."""
    return template.read_text(encoding="utf-8").format(**parts)


def table(header: list[str], rows: list[list[str]]) -> str:
    """Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def page_path(name: str) -> Path:
    """Where a page, or a figure of a page, lies: with the manual if it is there, else with the validation."""
    in_manual = REPOSITORY / "docs" / "manual" / name
    return in_manual if in_manual.exists() else REPOSITORY / "docs" / "validation" / name


def write_section(name: str, mark: str, text: str) -> None:
    """Write what follows a mark of a page up to the next one, and the mark where it is missing."""
    page = page_path(name).read_text(encoding="utf-8")
    before, _, after = page.partition(_mark(mark))
    rest = after.find(_mark("")[:4])
    others = "" if rest < 0 else f"\n\n{after[rest:]}"
    write_page(name, f"{before.rstrip()}\n\n{_mark(mark)}\n\n{text.rstrip()}{others}")


def section_after(name: str, mark: str) -> str:
    """What follows a mark of a page, the mark included, for the script that writes what comes before it."""
    page = page_path(name)
    parts = page.read_text(encoding="utf-8").split(_mark(mark)) if page.exists() else []
    return f"\n\n{_mark(mark)}{parts[1]}" if len(parts) == 2 else ""


def _mark(mark: str) -> str:
    return f"<!-- {mark} -->"


def write_page(name: str, text: str) -> None:
    """Write a page of the documentation whole."""
    target = page_path(name)
    temporary = target.with_suffix(".tmp")
    temporary.write_text(text.rstrip() + "\n", encoding="utf-8")
    temporary.replace(target)
    print(f"wrote {target.relative_to(REPOSITORY)}")

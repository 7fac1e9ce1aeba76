"""Run the notebooks and write copies with their outputs for reading on a web page, to notebooks/rendered.

python -m benchmarks.render_notebooks [NAME ...]

Each notebook runs in a process of its own, with nothing compiled before. Without names, all of them.
"""

import ast
import contextlib
import io
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.pages import REPOSITORY, machine

NOTEBOOKS = REPOSITORY / "notebooks"
RENDERED = NOTEBOOKS / "rendered"
# Line graphics and residual maps look the same with this many colours, at a third of the size.
_COLOURS = 96
_DPI = 110


class Cell(NamedTuple):
    """One cell of a notebook."""

    is_code: bool
    source: str


def cells(notebook: Path) -> list[Cell]:
    """Cells of a jupytext percent file, without its head."""
    head, *parts = re.split(r"^# %%", notebook.read_text(encoding="utf-8"), flags=re.MULTILINE)
    found = []
    for part in parts:
        kind, _, body = part.partition("\n")
        is_code = "[markdown]" not in kind
        lines = body.strip().splitlines()
        found.append(Cell(is_code, "\n".join(lines if is_code else [re.sub("^# ?", "", x) for x in lines])))
    return found


def rendered_text(source: str) -> str:
    """A cell of text with its links as seen from the folder of the rendered pages, to other such pages."""

    def moved(link: re.Match[str]) -> str:
        file, *place = link[1].split("#")
        is_notebook = file.endswith(".py") and "/" not in file
        return f"]({'#'.join([file.removesuffix('.py') + '.md' if is_notebook else f'../{file}', *place])})"

    return re.sub(r"\]\((?!https?://|#)([^)\s]+)\)", moved, source)


def rendered_code(page: Path) -> list[str]:
    """Sources of the code cells of a rendered page."""
    return re.findall(r"^```python\n(.*?)\n```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def names() -> list[str]:
    """Names of all notebooks."""
    return sorted(path.stem for path in NOTEBOOKS.glob("*.py"))


def outputs(source: str, names: dict[str, Any], show: Callable[[bytes], str]) -> Iterator[str]:
    """Run a cell as Jupyter does; its printed text, its last value and its figures, in markdown."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, "<cell>", "exec"), names)
        value = None if last is None else eval(compile(ast.Expression(last.value), "<cell>", "eval"), names)
    if printed.getvalue():
        yield _text(printed.getvalue())
    if hasattr(value, "_repr_png_"):
        yield show(value._repr_png_())
    elif value is not None:
        yield _text(repr(value))
    yield from map(show, open_figures())


def open_figures() -> Iterator[bytes]:
    """PNG files of the figures that pyplot holds open, which Jupyter shows after a cell."""
    import matplotlib.pyplot as plt

    for number in plt.get_fignums():
        stream = io.BytesIO()
        plt.figure(number).savefig(stream, format="png", dpi=_DPI)
        yield stream.getvalue()
    plt.close("all")


def _text(text: str) -> str:
    return f"```text\n{text.rstrip()}\n```"


def _small(png: bytes) -> bytes:
    from PIL import Image

    picture = Image.open(io.BytesIO(png)).convert("RGB").quantize(_COLOURS)
    stream = io.BytesIO()
    picture.save(stream, format="png", optimize=True)
    return stream.getvalue()


def render(name: str) -> None:
    """Run a notebook in this process and write its page and pictures."""
    pictures = {}

    def show(png: bytes) -> str:
        file = f"{name}-{len(pictures) + 1}.png"
        pictures[file] = _small(png)
        return f"![output]({file})"

    began, namespace, parts = time.process_time(), {"__name__": "__main__"}, []
    for cell in cells(NOTEBOOKS / f"{name}.py"):
        if cell.is_code:
            parts += [f"```python\n{cell.source}\n```", *outputs(cell.source, namespace, show)]
        else:
            parts.append(rendered_text(cell.source))
    seconds = time.process_time() - began
    origin = (
        f"*[{name}.py](../{name}.py) with its outputs, by `python -m benchmarks.render_notebooks {name}`; "
        f"{seconds:.0f} s of processor time ({machine()}).*"
    )
    for old in RENDERED.glob(f"{name}-*.png"):
        old.unlink()
    for file, content in pictures.items():
        (RENDERED / file).write_bytes(content)
    (RENDERED / f"{name}.md").write_text("\n\n".join([origin, *parts]) + "\n", encoding="utf-8")
    print(f"{name}: {seconds:.0f} s of processor time, {len(pictures)} pictures", flush=True)


def main() -> None:
    """Render what is named, each in its own process."""
    environment = dict(os.environ, MPLBACKEND="Agg")
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    # Without jaxink's store of programs.
    environment["JAXINK_CACHE_DIR"] = ""
    for name in sys.argv[1:] or names():
        program = f"from benchmarks.render_notebooks import render; render({name!r})"
        subprocess.run([sys.executable, "-c", program], env=environment, cwd=REPOSITORY, check=True)


if __name__ == "__main__":
    main()

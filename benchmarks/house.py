"""Measure the house: sizes, largest pieces, circles of imports, and what of the shapes is checked.

python -m benchmarks.house [TREE ...]

Each tree is a checkout, of any commit; without one, this repository. Files are read, nothing is imported.
"""

import ast
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

from benchmarks.pages import REPOSITORY, table

OPTION = "--jaxtyping-packages="


def python_files(folder: Path) -> list[Path]:
    """All modules below a folder, but not those of an environment."""
    return [p for p in sorted(folder.rglob("*.py")) if not any(part.startswith(".") for part in p.parts)]


def n_lines(files: list[Path]) -> int:
    """Lines of some files."""
    return sum(len(file.read_text(encoding="utf-8").splitlines()) for file in files)


class Source:
    """The package of a tree: its modules by name, as syntax trees."""

    def __init__(self, tree: Path):
        files = {
            ".".join(p.relative_to(tree / "src").with_suffix("").parts).removesuffix(".__init__"): p
            for p in python_files(tree / "src")
        }
        self.lines = {name: n_lines([file]) for name, file in files.items()}
        self.modules = {name: ast.parse(file.read_text(encoding="utf-8")) for name, file in files.items()}

    def largest_module(self) -> str:
        """Name and lines."""
        name = max(self.lines, key=self.lines.get)
        return f"{name.partition('.')[2]}, {self.lines[name]}"

    def largest_function(self) -> str:
        """Name and lines, docstring included."""
        lines, place = max(
            (node.end_lineno - node.lineno + 1, f"{name.partition('.')[2]}.{node.name}")
            for name, module in self.modules.items()
            for node in ast.walk(module)
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        )
        return f"{place}, {lines}"

    def imports(self, name: str) -> set[str]:
        """Modules of the package that a module imports, within functions as well."""
        found = set()
        for node in ast.walk(self.modules[name]):
            if isinstance(node, ast.ImportFrom) and node.module:
                members = {f"{node.module}.{alias.name}" for alias in node.names}
                found |= {member if member in self.modules else node.module for member in members}
            elif isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
        return (found & set(self.modules)) - {name}

    def past_interfaces(self) -> int:
        """Imports of a module of another package, past what the package's ``__init__`` lists."""
        utilities = {f"jaxink.{name}" for name in ("errors", "files", "numerics", "display")}
        return sum(
            1
            for name, module in self.modules.items()
            for node in ast.walk(module)
            if isinstance(node, ast.ImportFrom)
            and (parts := (node.module or "").split("."))[0] == "jaxink"
            and len(parts) > 2
            and (package := ".".join(parts[:2])) not in utilities
            and not f"{name}.".startswith(f"{package}.")
        )

    def circles(self) -> list[set[str]]:
        """Groups of modules each of which reaches all others of its group."""
        direct = {name: self.imports(name) for name in self.modules}
        reached = {name: _reached(direct, name) for name in self.modules}
        groups = {
            frozenset(other for other in reached[name] if name in reached[other])
            for name in self.modules
            if name in reached[name]
        }
        return sorted(map(set, groups), key=len)

    def shapes(self, packages: list[str]) -> tuple[int, int]:
        """Number of shape annotations in the modules of some packages, and of all."""
        counts = {name: sum(1 for _ in _shapes(module)) for name, module in self.modules.items()}
        checked = [n for n in counts if any(f"{n}.".startswith(f"{p}.") for p in packages)]
        return sum(counts[name] for name in checked), sum(counts.values())


def _reached(direct: dict[str, set[str]], start: str) -> set[str]:
    found, waiting = set(), [start]
    while waiting:
        new = direct[waiting.pop()] - found
        found |= new
        waiting += new
    return found


def _shapes(module: ast.Module) -> Iterator[ast.Subscript]:
    """Such as ``Float[Array, "n 3"]``."""
    names = {
        alias.asname or alias.name
        for node in ast.walk(module)
        if isinstance(node, ast.ImportFrom) and node.module == "jaxtyping"
        for alias in node.names
    }
    for node in ast.walk(module):
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id in names:
            parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else []
            if len(parts) == 2 and isinstance(parts[1], ast.Constant):
                yield node


def checked_packages(tree: Path) -> list[str]:
    """Packages whose shapes are checked while testing."""
    settings = tomllib.loads((tree / "pyproject.toml").read_text(encoding="utf-8"))
    options = settings["tool"]["pytest"]["ini_options"]["addopts"]
    found = [option.removeprefix(OPTION) for option in options if option.startswith(OPTION)]
    return found[0].split(",beartype")[0].split(",") if found else []


def measures(tree: Path) -> dict[str, str]:
    """All that is measured of one tree."""
    source = Source(tree)
    templates = sorted((tree / "benchmarks").rglob("*.md.in"))
    checked, shapes = source.shapes(checked_packages(tree))
    circles = source.circles()
    sizes = f" of {', '.join(str(len(circle)) for circle in circles)} modules" if circles else ""
    found = {
        f"lines of {part}": str(n_lines(python_files(tree / part))) for part in ("src", "tests", "benchmarks")
    }
    return found | {
        "lines of text for pages beside the scripts": str(n_lines(templates)),
        "modules of src": str(len(source.modules)),
        "imports past the interface of a package": str(source.past_interfaces()),
        "modules at the top of src/jaxink": str(len(list((tree / "src" / "jaxink").glob("*.py")))),
        "largest module, lines": source.largest_module(),
        "largest function, lines": source.largest_function(),
        "circles of imports": f"{len(circles)}{sizes}",
        "shape annotations checked": f"{checked} of {shapes}, {100 * checked / shapes:.0f} %",
    }


if __name__ == "__main__":
    trees = [Path(name).resolve() for name in sys.argv[1:]] or [REPOSITORY]
    columns = [measures(tree) for tree in trees]
    print(
        table(["", *(tree.name for tree in trees)], [[key, *(c[key] for c in columns)] for key in columns[0]])
    )

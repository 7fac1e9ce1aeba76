"""Rooms import only rooms below them, and modules do not import each other in circles."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src" / "jaxink"
# From the bottom to the top; rooms of one floor do not import each other.
FLOORS = (
    ("errors",),
    ("files", "numerics"),
    ("measurement",),
    ("optics",),
    ("particles",),
    ("surfaces",),
    # Surfaces turn a measured height map that a sample names into a few numbers.
    ("sample",),
    ("data", "solver"),
    ("model",),
    ("effects", "fitting"),
    ("diagnosis", "ink"),
    ("export",),
    ("plots",),
    ("report",),
    ("cli",),
    ("__main__",),
)
FLOOR_OF = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
MODULES = sorted(p for p in SOURCE.rglob("*.py") if p != SOURCE / "__init__.py")


def room_of(dotted: str) -> str:
    return dotted.split(".")[1]


def imported_rooms(path: Path) -> set[str]:
    """Rooms that a module imports anywhere, functions included."""
    rooms = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name} has a relative import"
            names = [node.module or ""]
            if node.module == "jaxink":
                names = [f"jaxink.{a.name}" for a in node.names if a.name in FLOOR_OF]
        else:
            continue
        rooms |= {room_of(name) for name in names if name.startswith("jaxink.")}
    return rooms


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_imports_point_down(path):
    room = path.relative_to(SOURCE).with_suffix("").parts[0]
    assert room in FLOOR_OF, f"room {room} has no floor"
    for other in imported_rooms(path) - {room}:
        allowed = FLOOR_OF[other] < FLOOR_OF[room]
        assert allowed, f"{path.relative_to(SOURCE)} imports {other}, which is not below {room}"


def imported_modules(path: Path, known: set[str]) -> set[str]:
    """Modules that a module imports anywhere, functions included."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            dotted = {f"{node.module}.{alias.name}" for alias in node.names}
            names |= dotted & known or {node.module}
    return names & known


def test_modules_import_in_no_circle():
    modules = {".".join(p.relative_to(SOURCE.parent).with_suffix("").parts): p for p in MODULES}
    modules = {name.removesuffix(".__init__"): path for name, path in modules.items()}
    graph = {name: imported_modules(path, set(modules)) for name, path in modules.items()}
    # Raises an error that names the modules of a circle.
    TopologicalSorter(graph).prepare()


@pytest.mark.parametrize("room", ["measurement", "sample", "optics.refractive_index", "errors"])
def test_reading_needs_no_jax(room):
    code = (
        f"import sys, jaxink.{room}; sys.exit(any(m in sys.modules for m in ('jax', 'xarray', 'matplotlib')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_public_names_exist_in_a_fresh_interpreter():
    code = "import jaxink; [getattr(jaxink, name) for name in jaxink.__all__]"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

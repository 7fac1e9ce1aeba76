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
    ("display",),
    ("materials", "measurement"),
    ("optics", "residual"),
    ("particles",),
    ("surfaces",),
    # Surfaces turn a measured height map that a sample names into a few numbers.
    ("sample",),
    ("data", "projects", "solver"),
    ("model",),
    ("effects",),
    ("colour",),
    ("fitting",),
    ("diagnosis", "ink", "planning"),
    ("export",),
    ("plots", "render"),
    ("report",),
    ("batches",),
    ("cli",),
    ("__main__",),
)
FLOOR_OF = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
# Rooms of tools, each module of which is its own face.
TOOLS = {"errors", "files", "numerics", "display"}
# Of the diagnosis, from the bottom to the top.
DIAGNOSIS = ("policy", "statistics", "search", "findings", "joint", "procedure")
MODULES = sorted(p for p in SOURCE.rglob("*.py") if p != SOURCE / "__init__.py")
INNER = [p for p in MODULES if p.is_relative_to(SOURCE / "diagnosis") and p.parent.parent != SOURCE]
INNER += [SOURCE / "diagnosis" / f"{name}.py" for name in ("policy", "procedure")]


NAMES = {".".join(p.relative_to(SOURCE.parent).with_suffix("").parts): p for p in MODULES}
NAMES = {name.removesuffix(".__init__"): path for name, path in NAMES.items()}


def room_of(dotted: str) -> str:
    return dotted.split(".")[1]


def imported_modules(path: Path) -> set[str]:
    """Modules and rooms of jaxink that a module imports anywhere, functions included."""
    modules = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name} has a relative import"
            names = {f"{node.module}.{alias.name}" for alias in node.names} & NAMES.keys() or [node.module]
        else:
            continue
        modules |= {name for name in names if name.startswith("jaxink.")}
    return modules


def imported_rooms(path: Path) -> set[str]:
    """Rooms that a module imports anywhere, functions included."""
    return {room_of(name) for name in imported_modules(path)}


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_imports_point_down(path):
    room = path.relative_to(SOURCE).with_suffix("").parts[0]
    assert room in FLOOR_OF, f"room {room} has no floor"
    for other in imported_rooms(path) - {room}:
        allowed = FLOOR_OF[other] < FLOOR_OF[room]
        assert allowed, f"{path.relative_to(SOURCE)} imports {other}, which is not below {room}"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_other_rooms_are_entered_by_their_face(path):
    room = path.relative_to(SOURCE).with_suffix("").parts[0]
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.ImportFrom):
            continue
        other = room_of(node.module) if node.module.startswith("jaxink.") else room
        if other != room and other not in TOOLS:
            names = ", ".join(alias.name for alias in node.names)
            assert node.module == f"jaxink.{other}", (
                f"import {names} from jaxink.{other}, whose __init__ lists it"
            )


def test_a_face_has_no_name_that_is_a_module_of_the_room():
    # Which of the two such a name is would depend on what was imported before.
    for face in [*SOURCE.glob("*/__init__.py"), *SOURCE.glob("*/__init__.pyi")]:
        room = f"jaxink.{face.parent.name}"
        nodes = [n for n in ast.walk(ast.parse(face.read_text())) if isinstance(n, ast.ImportFrom)]
        own = [node for node in nodes if node.level == 1 or node.module.startswith(f"{room}.")]
        names = {alias.name for node in own for alias in node.names}
        assert not names & {path.stem for path in face.parent.glob("*.py")}, room


@pytest.mark.parametrize("path", INNER, ids=lambda p: str(p.relative_to(SOURCE)))
def test_imports_of_the_diagnosis_point_down(path):
    floor = DIAGNOSIS.index(path.relative_to(SOURCE / "diagnosis").with_suffix("").parts[0])
    below = {f"jaxink.diagnosis.{room}" for room in DIAGNOSIS[: floor + 1]}
    for other in imported_modules(path):
        if other.startswith("jaxink.diagnosis"):
            allowed = ".".join(other.split(".")[:3]) in below
            assert allowed, f"{path.relative_to(SOURCE)} imports {other}, which is not below it"


def test_statistics_of_the_diagnosis_know_neither_model_nor_jax():
    # Not by way of the package itself, which imports all of its rooms.
    code = f"""
import importlib, pkgutil, sys, types
package = types.ModuleType("jaxink.diagnosis")
package.__path__ = [{str(SOURCE / "diagnosis")!r}]
sys.modules["jaxink.diagnosis"] = package
import jaxink.diagnosis.statistics as room
for module in pkgutil.iter_modules(room.__path__):
    importlib.import_module(f"jaxink.diagnosis.statistics.{{module.name}}")
rooms = {{name.split(".")[1] for name in sys.modules if name.startswith("jaxink.")}}
allowed = {{"diagnosis", "display", "errors", "files", "measurement", "numerics"}}
assert not {{"jax", "equinox"}} & set(sys.modules), "it imports JAX"
assert rooms <= allowed, rooms - allowed
"""
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_modules_import_in_no_circle():
    # Raises an error that names the modules of a circle.
    TopologicalSorter({name: imported_modules(path) for name, path in NAMES.items()}).prepare()


@pytest.mark.parametrize("room", ["measurement", "sample", "errors"])
def test_reading_needs_no_jax(room):
    code = (
        f"import sys, jaxink.{room}; sys.exit(any(m in sys.modules for m in ('jax', 'xarray', 'matplotlib')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_public_names_exist_in_a_fresh_interpreter():
    code = "import jaxink; [getattr(jaxink, name) for name in jaxink.__all__]"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

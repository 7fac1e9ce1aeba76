"""Packages import only packages below them, and modules do not import each other in circles."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src" / "jaxink"
# From the bottom to the top; packages of one layer do not import each other.
LAYERS = (
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
LAYER_OF = {package: layer for layer, packages in enumerate(LAYERS) for package in packages}
# Packages of which every module is public to all others.
UTILITIES = {"errors", "files", "numerics", "display"}
# Of the diagnosis, from the bottom to the top.
DIAGNOSIS = ("policy", "statistics", "search", "findings", "joint", "procedure")
MODULES = sorted(p for p in SOURCE.rglob("*.py") if p != SOURCE / "__init__.py")
INNER = [p for p in MODULES if p.is_relative_to(SOURCE / "diagnosis") and p.parent.parent != SOURCE]
INNER += [SOURCE / "diagnosis" / f"{name}.py" for name in ("policy", "procedure")]


NAMES = {".".join(p.relative_to(SOURCE.parent).with_suffix("").parts): p for p in MODULES}
NAMES = {name.removesuffix(".__init__"): path for name, path in NAMES.items()}


def package_of(dotted: str) -> str:
    return dotted.split(".")[1]


def imported_modules(path: Path) -> set[str]:
    """Modules and packages of jaxink that a module imports anywhere, functions included."""
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


def imported_packages(path: Path) -> set[str]:
    """Packages that a module imports anywhere, functions included."""
    return {package_of(name) for name in imported_modules(path)}


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_imports_point_down(path):
    package = path.relative_to(SOURCE).with_suffix("").parts[0]
    assert package in LAYER_OF, f"package {package} has no layer"
    for other in imported_packages(path) - {package}:
        allowed = LAYER_OF[other] < LAYER_OF[package]
        assert allowed, f"{path.relative_to(SOURCE)} imports {other}, which is not below {package}"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_other_packages_are_imported_by_their_public_interface(path):
    package = path.relative_to(SOURCE).with_suffix("").parts[0]
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.ImportFrom):
            continue
        other = package_of(node.module) if node.module.startswith("jaxink.") else package
        if other != package and other not in UTILITIES:
            names = ", ".join(alias.name for alias in node.names)
            assert node.module == f"jaxink.{other}", (
                f"import {names} from jaxink.{other}, whose __init__ lists it"
            )


def test_an_interface_has_no_name_that_is_a_module_of_the_package():
    # Which of the two such a name is would depend on what was imported before.
    for interface in [*SOURCE.glob("*/__init__.py"), *SOURCE.glob("*/__init__.pyi")]:
        package = f"jaxink.{interface.parent.name}"
        nodes = [n for n in ast.walk(ast.parse(interface.read_text())) if isinstance(n, ast.ImportFrom)]
        own = [node for node in nodes if node.level == 1 or node.module.startswith(f"{package}.")]
        names = {alias.name for node in own for alias in node.names}
        assert not names & {path.stem for path in interface.parent.glob("*.py")}, package


@pytest.mark.parametrize("path", INNER, ids=lambda p: str(p.relative_to(SOURCE)))
def test_imports_of_the_diagnosis_point_down(path):
    layer = DIAGNOSIS.index(path.relative_to(SOURCE / "diagnosis").with_suffix("").parts[0])
    below = {f"jaxink.diagnosis.{part}" for part in DIAGNOSIS[: layer + 1]}
    for other in imported_modules(path):
        if other.startswith("jaxink.diagnosis"):
            allowed = ".".join(other.split(".")[:3]) in below
            assert allowed, f"{path.relative_to(SOURCE)} imports {other}, which is not below it"


def test_statistics_of_the_diagnosis_know_neither_model_nor_jax():
    # Not by way of the package itself, which imports all of its parts.
    code = f"""
import importlib, pkgutil, sys, types
package = types.ModuleType("jaxink.diagnosis")
package.__path__ = [{str(SOURCE / "diagnosis")!r}]
sys.modules["jaxink.diagnosis"] = package
import jaxink.diagnosis.statistics as statistics
for module in pkgutil.iter_modules(statistics.__path__):
    importlib.import_module(f"jaxink.diagnosis.statistics.{{module.name}}")
packages = {{name.split(".")[1] for name in sys.modules if name.startswith("jaxink.")}}
allowed = {{"diagnosis", "display", "errors", "files", "measurement", "numerics"}}
assert not {{"jax", "equinox"}} & set(sys.modules), "it imports JAX"
assert packages <= allowed, packages - allowed
"""
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_modules_import_in_no_circle():
    # Raises an error that names the modules of a circle.
    TopologicalSorter({name: imported_modules(path) for name, path in NAMES.items()}).prepare()


@pytest.mark.parametrize("package", ["measurement", "sample", "errors"])
def test_reading_needs_no_jax(package):
    code = (
        f"import sys, jaxink.{package}; "
        "sys.exit(any(m in sys.modules for m in ('jax', 'xarray', 'matplotlib')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_public_names_exist_in_a_fresh_interpreter():
    code = "import jaxink; [getattr(jaxink, name) for name in jaxink.__all__]"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

"""What ``import jaxink`` offers, and that it loads nothing before it is used."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import jaxink
from jaxink.files.version import installed_version

PACKAGES = ("data", "diagnosis", "effects", "errors", "export", "fitting", "plots", "report")


@pytest.mark.parametrize("name", ["errors", "report"])
def test_a_package_is_an_attribute_without_an_import_of_its_own(name):
    program = f"import jaxink; print(jaxink.{name}.__name__)"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.strip() == f"jaxink.{name}"


def test_dir_lists_names_packages_and_the_version():
    assert {*jaxink.__all__, *PACKAGES, "__version__"} == set(dir(jaxink))
    assert jaxink.__version__ == installed_version()


def lazy_packages():
    """The packages whose names are imported on first use."""
    source = Path(jaxink.__file__).parent
    homes = [path.parent for path in source.rglob("__init__.pyi")]
    return [".".join(home.relative_to(source.parent).parts) for home in homes]


@pytest.mark.parametrize("name", sorted({*lazy_packages()} - {"jaxink"}))
def test_dir_lists_what_a_package_offers_and_no_more(name):
    package = import_module(name)
    assert dir(package) == sorted(package.__all__)
    assert all(getattr(package, each) is not None for each in package.__all__)


def test_the_import_loads_neither_jax_nor_numpy():
    program = "import sys, jaxink; dir(jaxink); sys.exit(any(n in sys.modules for n in ('jax', 'numpy')))"
    assert subprocess.run([sys.executable, "-c", program], timeout=60, check=False).returncode == 0

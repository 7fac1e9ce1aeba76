"""What ``import jaxink`` offers, and that it loads nothing before it is used."""

import subprocess
import sys

import pytest

import jaxink
from jaxink.files.version import installed_version

PACKAGES = ("data", "diagnosis", "effects", "errors", "export", "fitting", "plots", "report")


@pytest.mark.parametrize("name", PACKAGES)
def test_a_package_is_an_attribute_without_an_import_of_its_own(name):
    program = f"import jaxink; print(jaxink.{name}.__name__)"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.strip() == f"jaxink.{name}"


def test_dir_lists_names_packages_and_the_version():
    assert {*jaxink.__all__, *PACKAGES, "__version__"} == set(dir(jaxink))
    assert jaxink.__version__ == installed_version()


def test_the_import_loads_neither_jax_nor_numpy():
    program = "import sys, jaxink; dir(jaxink); sys.exit(any(n in sys.modules for n in ('jax', 'numpy')))"
    assert subprocess.run([sys.executable, "-c", program], timeout=60, check=False).returncode == 0

"""Versions that files name."""

import numpy as np

from jaxink.files.version import installed_version


def test_a_package_that_is_not_installed_has_an_unknown_version():
    assert installed_version("no-such-package") == "unknown"
    assert installed_version("numpy") == np.__version__

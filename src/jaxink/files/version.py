"""Versions of packages, as files name them."""

from functools import cache


@cache
def installed_version(package: str = "jaxink") -> str:
    """Version of a package; ``unknown`` if it is not installed, as in a source tree of jaxink.

    Parameters
    ----------
    package
        Its name.
    """
    # Takes longer to import than the help of a command may take.
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"

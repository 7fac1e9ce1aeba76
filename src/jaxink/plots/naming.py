"""Names of the fits of one figure."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jaxink.fitting import FitResult


def named_results(
    results: "FitResult | Sequence[FitResult] | Mapping[str, FitResult]",
) -> "dict[str, FitResult]":
    """Fits by the names to show: those of a mapping, or their methods, numbered where several are alike."""
    if isinstance(results, Mapping):
        return dict(results)
    named: dict[str, FitResult] = {}
    for result in list(results) if isinstance(results, Sequence) else [results]:
        same = sum(name.split(" ")[0] == result.method for name in named)
        named[f"{result.method} {same + 1}" if same else result.method] = result
    return named

"""Accuracy that the resolution is chosen for: its default and its range."""

from numbers import Real

from jaxink.errors import InputRefusedError, shown

# Largest relative error of the BSDF.
DEFAULT_ACCURACY = 1e-4
BEST_ACCURACY, WORST_ACCURACY = 1e-8, 0.1


def require_accuracy(accuracy: float) -> None:
    """Reject an accuracy for which no resolution can be chosen.

    Raises
    ------
    InputRefusedError
        If the largest relative error of the BSDF is not between 1e-8 and 0.1.
    """
    if not (isinstance(accuracy, Real) and BEST_ACCURACY <= accuracy <= WORST_ACCURACY):
        raise InputRefusedError(
            f"accuracy is {shown(accuracy)}; "
            f"give a relative error between {BEST_ACCURACY:g} and {WORST_ACCURACY:g}."
        )

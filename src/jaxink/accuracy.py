"""The accuracy that a user asks of the discretisation: the default, and what may be asked."""

from jaxink.errors import InputRefusedError, require_number

# Largest relative error of the BSDF.
DEFAULT_ACCURACY = 1e-4
BEST_ACCURACY, WORST_ACCURACY = 1e-8, 0.1


def require_accuracy(accuracy: float) -> None:
    """Refuse an accuracy that no sizes can be chosen for.

    Parameters
    ----------
    accuracy
        Largest relative error of the BSDF that the discretisation may cause.

    Raises
    ------
    InputRefusedError
        If it is not between 1e-8 and 0.1.
    """
    require_number("accuracy", accuracy)
    if not BEST_ACCURACY <= accuracy <= WORST_ACCURACY:
        raise InputRefusedError(
            f"accuracy is {accuracy:g}; "
            f"give a relative error between {BEST_ACCURACY:g} and {WORST_ACCURACY:g}."
        )

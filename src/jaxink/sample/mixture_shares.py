"""Shares of the inks that a layer is mixed from: parts of its volume."""

from collections.abc import Mapping

from jaxink.errors import InputRefusedError

# Shares that a printer states in per cent may be rounded.
ROUNDING = 1e-3


def require_at_most_whole(layer: str, shares: Mapping[str, float]) -> None:
    """Reject shares that are more than the layer together.

    Parameters
    ----------
    layer
        Its name.
    shares
        By the name of the ink.
    """
    total = sum(shares.values())
    if total > 1 + ROUNDING:
        raise InputRefusedError(
            f"layer '{layer}': the shares of mixture add up to {total:g}; they are parts of the volume, at "
            "most 1 together. What is left of 1 is clear binder."
        )


def require_whole(layer: str, shares: Mapping[str, float]) -> None:
    """Reject shares of an opaque layer that do not add up to 1: only their ratios would count.

    Parameters
    ----------
    layer, shares
        See `require_at_most_whole`.
    """
    total = sum(shares.values())
    if abs(total - 1) > ROUNDING:
        *others, last = shares
        tie = " - ".join(("1", *(f"{layer}.mixture.{ink}" for ink in others)))
        follows = f' One share may follow from the others: {last} = {{ tie = "{tie}" }}.' if others else ""
        raise InputRefusedError(
            f"layer '{layer}': the shares of mixture add up to {total:g}; clear binder changes nothing in an "
            f"opaque layer, so they must add up to 1. Is an ink missing?{follows}"
        )

"""Formatting of numbers with the digits that their uncertainty justifies."""

import math


def with_uncertainty(value: float, error: float | None) -> str:
    """A value with its standard error in units of the last digit, ``1.234(5)``.

    The error has one digit, or two from 10 to 19. Without a known error, the value has six digits.
    """
    if error is None or not math.isfinite(error) or error <= 0 or not math.isfinite(value):
        return plain(value)
    last = math.floor(math.log10(error))
    if round(error / 10.0 ** (last - 1)) <= 19:
        last -= 1
    count = round(error / 10.0**last)
    size = math.floor(math.log10(max(abs(value), error)))
    if not -4 <= size < 6:
        # Rounding may carry, so take the exponent from the rounded value.
        rounded = max(abs(round(value / 10.0**last)), count) * 10.0**last
        size = math.floor(math.log10(rounded) + 1e-9)
        return f"{value / 10.0**size:.{size - last}f}({count})e{size:+03d}"
    if last > 0:
        return f"{round(value, -last):.0f}({count * 10**last})"
    return f"{value:.{-last}f}({count})"


def plus_minus(value: float, error: float | None) -> str:
    """A value with its standard error, ``1.234 +- 0.005``, for sentences.

    The error has two digits, and the value as many decimals; without a known error, it has four digits.
    """
    if error is None or not math.isfinite(error) or error <= 0 or not math.isfinite(value):
        return rounded(value, 4)
    if not 1e-4 <= max(abs(value), error) < 1e6:
        return f"{value:.3g} +- {error:.2g}"
    decimals = max(1 - math.floor(math.log10(error)), 0)
    return f"{value:.{decimals}f} +- {error:.{decimals}f}"


def interval(low: float, high: float) -> str:
    """Ends of an interval, with two digits of its width."""
    width = high - low
    if not math.isfinite(width) or width <= 0 or not 1e-4 <= max(abs(low), abs(high)) < 1e6:
        return f"{plain(low)} ... {plain(high)}"
    decimals = max(1 - math.floor(math.log10(width)), 0)
    return f"{low:.{decimals}f} ... {high:.{decimals}f}"


def plain(value: float) -> str:
    """Six significant digits."""
    return f"{value:.6g}"


def rounded(value: float | None, digits: int = 3, missing: str = "") -> str:
    """Number with so many significant digits, or ``missing`` for None and NaN."""
    return missing if value is None or math.isnan(value) else f"{value:.{digits}g}"


def percent(share: float | None, form: str = ".3g", missing: str = "") -> str:
    """A fraction in per cent, in a Python format, or ``missing`` for None and NaN."""
    return missing if share is None or math.isnan(share) else f"{100 * share:{form}} %"


def relative_error(value: float, error: float | None) -> str:
    """Error relative to the value in per cent; empty if there is none."""
    if error is None or value == 0 or not math.isfinite(error):
        return ""
    return percent(abs(error / value), ".2g")

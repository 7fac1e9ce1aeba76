"""Exceptions of jaxink; each carries one sentence that a user can act on."""


class JaxinkError(Exception):
    """Base class of every error that jaxink raises on purpose."""


class InputRefusedError(JaxinkError, ValueError):
    """An input is wrong; the message names the file, row, column or parameter and the remedy."""


class PrecisionError(JaxinkError, RuntimeError):
    """A differentiable function was called while JAX computes in 32 bits."""


class UnsafeVersionError(JaxinkError, RuntimeError):
    """The installed jaxlib is one that can deadlock."""

"""The command ``jaxink``; nothing heavy is imported before a command needs it."""

from jaxink.cli.app import main

__all__ = ["main"]

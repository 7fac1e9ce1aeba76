"""``python -m jaxink`` is the command ``jaxink``."""

from jaxink.cli import main

main()

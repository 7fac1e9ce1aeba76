"""Output that takes its place whole or not at all."""

from jaxink.output.moves import settle
from jaxink.output.whole import require_room, staging_place, whole_folder, written_whole

__all__ = ["require_room", "settle", "staging_place", "whole_folder", "written_whole"]

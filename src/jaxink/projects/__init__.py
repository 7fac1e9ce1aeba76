"""Projects: several measurements of one ink, and what differs between them."""

from jaxink.projects.project import Measurement, Project
from jaxink.projects.reading import load_project, parse_project

__all__ = ["Measurement", "Project", "load_project", "parse_project"]

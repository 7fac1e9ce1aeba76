"""Projects: several measurements of one ink, and what differs between them."""

from jaxink.projects.draft import first_measurements, project_text
from jaxink.projects.project import OF, Measurement, Project
from jaxink.projects.reading import load_project, parse_project
from jaxink.projects.splitting import conditions_in
from jaxink.projects.toml_text import toml_key, toml_value

__all__ = [
    "OF",
    "Measurement",
    "Project",
    "conditions_in",
    "first_measurements",
    "load_project",
    "parse_project",
    "project_text",
    "toml_key",
    "toml_value",
]

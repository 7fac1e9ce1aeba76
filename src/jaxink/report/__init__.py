"""The report of a diagnosis as JSON, HTML and figures."""

from jaxink.report.next_steps import NextStep, next_steps
from jaxink.report.writing import write_report

__all__ = ["NextStep", "next_steps", "write_report"]

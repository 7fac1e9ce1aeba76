"""The report of a diagnosis as JSON, HTML and figures."""

from jaxink.report.writing import write_report

__all__ = ["write_report"]

"""The report of a diagnosis: files for a program, for a browser and for paper."""

from jaxink.report.writing import write_report

__all__ = ["write_report"]

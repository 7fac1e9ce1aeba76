"""The page of a fit, and the report of a diagnosis as JSON, HTML and figures."""

from jaxink.report import html
from jaxink.report.fit_html import fit_page
from jaxink.report.fit_writing import fit_drawings, write_fit_page
from jaxink.report.ink_table import inside_change
from jaxink.report.joint_diagnosis_page import write_joint_diagnosis_page
from jaxink.report.joint_page import write_joint_page
from jaxink.report.suggestions import NextStep, fit_next_steps, joint_next_steps, next_steps
from jaxink.report.writing import write_report

__all__ = [
    "NextStep",
    "fit_drawings",
    "fit_next_steps",
    "fit_page",
    "html",
    "inside_change",
    "joint_next_steps",
    "next_steps",
    "write_fit_page",
    "write_joint_diagnosis_page",
    "write_joint_page",
    "write_report",
]

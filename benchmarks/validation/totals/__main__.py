"""Fit samples measured as totals, not as a BSDF, and write docs/validation/measured-totals.md.

python -m benchmarks.validation.totals
"""

from benchmarks.pages import machine, write_page
from benchmarks.validation.totals.discs_page import discs_section
from benchmarks.validation.totals.sphere_page import sphere_section
from jaxink.numerics.precision import computing


def main() -> None:
    """Write the page."""
    with computing():
        sections = f"{discs_section()}\n{sphere_section()}"
    text = f"""# Measured totals

Transmittances, and readings of an integrating sphere, by others; no BSDF was measured. The data are not part
of the repository; this page is made by `python -m benchmarks.validation.totals`
({machine()}).

{sections}"""
    write_page("measured-totals.md", text)


if __name__ == "__main__":
    main()

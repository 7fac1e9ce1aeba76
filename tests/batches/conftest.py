import pytest

from tests.samples import GOOD_SAMPLE

PLAN = """\
schema_version = 1
sample = "sample.toml"
[measurements]
files = "*.csv"
"""


@pytest.fixture
def folder(tmp_path):
    """A plan with three sheets, which the stand-ins of a fit answer."""
    (tmp_path / "plan.toml").write_text(PLAN)
    (tmp_path / "sample.toml").write_text(GOOD_SAMPLE)
    for number in (1, 2, 3):
        (tmp_path / f"sheet_{number}.csv").write_text(str(number))
    return tmp_path

"""A folder keeps one kind of result, and no file that is not jaxink's is replaced."""

import itertools

import pytest

from jaxink.errors import InputRefusedError
from jaxink.files.result_folder import (
    JOINT_FILE,
    JOINT_REPORT,
    PARAMETER_FILE,
    REPORT_FILE,
    RESULT_FILE,
    require_not_replaced,
)

KINDS = RESULT_FILE, REPORT_FILE, JOINT_FILE, JOINT_REPORT


@pytest.mark.parametrize(("there", "own"), [*itertools.product(KINDS, KINDS)])
def test_a_result_replaces_its_own_kind_only(there, own, tmp_path):
    (tmp_path / there).touch()
    if there == own:
        require_not_replaced(tmp_path, [], own)
        return
    with pytest.raises(InputRefusedError, match=f"holds .*{there}.*choose another folder"):
        require_not_replaced(tmp_path, [], own)


def test_a_file_of_somebody_else_is_kept(tmp_path):
    (tmp_path / PARAMETER_FILE).write_text("my,own,table\n")
    with pytest.raises(InputRefusedError, match=PARAMETER_FILE):
        require_not_replaced(tmp_path, [], RESULT_FILE)


def test_a_new_folder_has_nothing_to_replace(tmp_path):
    require_not_replaced(tmp_path / "new", [], RESULT_FILE)

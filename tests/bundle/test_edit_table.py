"""Each edit of the table is taken over, refused or reported. No edit is lost silently."""

from collections import Counter
from pathlib import Path

import pytest

from stereocell.model.errors import StageError
from support.bundles import files
from support.edit_cases import CASES, markdown


@pytest.mark.parametrize("case", [pytest.param(case, id=case.what) for case in CASES])
def test_edit_is_taken_over_refused_or_reported(bundle, edit, case):
    if case.outcome == "refused":
        with pytest.raises(StageError, match=case.words.replace(".", r"\.")):
            edit(case.change)
        return
    edited = edit(case.change)
    lost = [line for line in edit.lines if "is not taken over" in line]
    if case.outcome == "taken":
        assert lost == []
        assert files(edited) != files(bundle)
    else:
        assert [case.words in line for line in lost] == [True]
        assert (files(edited) == files(bundle)) != case.is_partial


def test_the_docs_have_the_table():
    page = Path(__file__).parents[2] / "docs/edit-table.md"
    assert "\n".join(markdown()) in page.read_text("utf-8")


def test_edits_have_one_row_each_and_every_outcome_occurs():
    assert len({case.what for case in CASES}) == len(CASES)
    assert set(Counter(case.outcome for case in CASES)) == {"taken", "refused", "reported"}

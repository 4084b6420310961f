"""Values that a source states more than once: the most trusted one is used, and a note says so."""

import pytest

from stereocell.read.statements import Statement, Subject, Trust, omission, settle

_SPACING_Z = Subject("voxel spacing along z", "um", remedy="--spacing-um z,y,x replaces it")


def test_statements_that_agree_need_no_note() -> None:
    found = settle(_SPACING_Z, [Statement(0.6, "PhysicalSizeZ"), Statement(0.60001, "PositionZ")])
    assert (found.number, found.notes) == (0.6, ())


def test_a_measured_value_is_trusted_more_than_a_field() -> None:
    found = settle(
        _SPACING_Z,
        [Statement(1.0, "PhysicalSizeZ"), Statement(0.6, "PositionZ", Trust.MEASURED)],
    )
    assert found.number == 0.6
    assert found.notes == (
        "voxel spacing along z: PositionZ states 0.6 um, PhysicalSizeZ states 1 um: PositionZ is "
        "used; --spacing-um z,y,x replaces it",
    )


def test_a_contradiction_that_the_user_s_own_value_settles_needs_no_note() -> None:
    given = Statement(2.0, "--spacing-um", Trust.GIVEN)
    assert settle(_SPACING_Z, [Statement(1.0, "PhysicalSizeZ"), given]).notes == ()


def test_an_assumption_is_explained() -> None:
    found = settle(
        Subject("unit of length"), [Statement("mm", "as in most NIfTI files", Trust.ASSUMED)]
    )
    assert found.notes == ("unit of length: not stated, mm is assumed, as in most NIfTI files",)


def test_an_assumption_does_not_contradict_a_statement() -> None:
    found = settle(
        Subject("unit of length"),
        [Statement("mm", "as in most NIfTI files", Trust.ASSUMED), Statement("um", "xyzt_units")],
    )
    assert (found.value, found.notes) == ("um", ())


@pytest.mark.parametrize(
    ("one", "other", "is_same"),
    [
        (("z", "y", "x"), ("z", "y", "x"), True),
        (("z", "y", "x"), ("x", "y", "z"), False),
        ((1.0, 2.0, 2.0), (1.0, 2.0, 2.0005), True),
        ((1.0, 2.0, 2.0), (1.0, 2.0), False),
        ("HU", "counts", False),
    ],
)
def test_values_are_compared_part_by_part(one: tuple, other: tuple, is_same: bool) -> None:  # type: ignore[type-arg]
    found = settle(Subject("order"), [Statement(one, "axes"), Statement(other, "names")])
    assert (not found.notes) == is_same


def test_a_note_lists_few_of_many_contradictions() -> None:
    many = [Statement(float(value), f"file {value}") for value in range(1, 9)]
    (note,) = settle(_SPACING_Z, many).notes
    assert "file 4 states 4 um, 4 more differ as well: file 1 is used" in note


def test_an_omission_names_the_data_the_reason_and_the_way_to_read_it() -> None:
    assert omission("5 derived images", "they are projections of the others", "--series 2") == (
        "left out: 5 derived images, because they are projections of the others; --series 2"
    )

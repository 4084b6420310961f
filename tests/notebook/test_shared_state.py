"""The parts of the view that a notebook may set are checked."""

import numpy as np
import pytest

from stereocell.model.errors import UsageError
from stereocell.notebook.shared_state import check_channels, check_link, check_picked, check_view

KNOWN = {"CD31": "CD31", "DNA": "DNA", "a marker": "a_x20_marker"}


def test_valid_values_are_returned_as_plain_numbers():
    look = {"visible": True, "color": "#FF8000", "opacity": 1, "window": np.array([1, 5])}
    assert check_channels({"CD31": look}, KNOWN) == {
        "CD31": {"visible": True, "color": "#ff8000", "opacity": 1.0, "window": [1.0, 5.0]}
    }
    assert check_channels({"a marker": {}}, KNOWN) == {"a_x20_marker": {}}
    assert check_view({"eye_um": np.arange(3)}) == {"eye_um": [0.0, 1.0, 2.0]}
    assert check_picked({"point_um": (1, 2, 3)}) == {"point_um": [1.0, 2.0, 3.0]}
    assert check_picked(None) is None
    assert check_link("https://me.example/mine/#v=1&c=DNA") == "#v=1&c=DNA"
    assert check_link("") == ""


@pytest.mark.parametrize(
    ("channels", "message"),
    [
        ({"CD8": {}}, "there is no 'CD8', expected CD31, DNA, a marker"),
        ({"CD31": 5}, "CD31 is 5, expected a dict such as"),
        ({"CD31": {"colour": "#ff8000"}}, "no 'colour', expected visible, color"),
        ({"CD31": {"visible": 1}}, "True or False"),
        ({"CD31": {"color": "red"}}, "a colour such as '#ff8000'"),
        ({"CD31": {"opacity": 1.5}}, "0 to 1"),
        ({"CD31": {"opacity": "1"}}, "0 to 1"),
        ({"CD31": {"window": (5, 1)}}, "lower"),
        ({"CD31": {"window": (1, float("nan"))}}, "two of the source's values"),
    ],
)
def test_impossible_appearances_of_channels_are_refused_in_a_line(channels, message):
    with pytest.raises(UsageError, match=message):
        check_channels(channels, KNOWN)


@pytest.mark.parametrize(
    ("check", "value", "message"),
    [
        (check_view, {"eye": (0, 0, 0)}, "view: 'eye' is unknown, expected eye_um"),
        (check_view, {"eye_um": (0, 0)}, "expected x, y, z"),
        (
            check_view,
            {"eye_um": (1, 1, 1), "target_um": (1, 1, 1)},
            "expected two different points",
        ),
        (check_picked, {"tile": "r0_c0"}, "point_um"),
        (check_picked, {"point_um": (1, 2, 3), "path": "/root"}, "expected"),
        (check_picked, {"point_um": (1, 2, 3), "object": 5}, "expected"),
        (check_link, "r0_c0", "expected a link to a view"),
        (check_link, "#" + "v=1" * 4000, "at most 8000"),
    ],
)
def test_impossible_views_points_and_links_are_refused_in_a_line(check, value, message):
    with pytest.raises(UsageError, match=message):
        check(value)

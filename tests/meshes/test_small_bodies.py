"""Small bodies are removed from coarse levels."""

import numpy as np
import pytest

from stereocell.meshes.simplify import compact
from stereocell.meshes.small_bodies import SmallBodies
from support.meshes import ball, joined, moved

LARGE, SMALL = ball(10.0, 40), moved(ball(0.5), (12.0, 0.0, 0.0))
FAR = 11.0


@pytest.mark.parametrize(("error_um", "goes"), [(0.4, False), (0.5, True)])
def test_a_body_is_removed_if_its_diagonal_is_under_four_errors(
    error_um: float, goes: bool
) -> None:
    both = joined(LARGE, SMALL)  # the diagonal of the small body is 1.73
    found = SmallBodies(both).find(error_um)
    np.testing.assert_array_equal(found, (both.positions[:, 0] > FAR) & goes)


def test_removed_bodies_have_at_most_a_fiftieth_of_the_area() -> None:
    many = joined(ball(3.0), *(moved(ball(0.4 + 0.01 * k), (6.0 + 2 * k, 0, 0)) for k in range(9)))
    found = SmallBodies(many).find(1.0)
    gone = sorted({round(float(x) / 2) * 2 for x in many.positions[found, 0]})
    assert gone == [6]  # only the smallest


def test_bodies_of_equal_size_stay() -> None:
    assert not SmallBodies(joined(ball(0.5), SMALL)).find(5.0).any()


def test_a_body_that_a_cut_opens_stays() -> None:
    both = joined(LARGE, SMALL)
    opened = compact(both, both.triangles[:-1])
    assert not SmallBodies(opened).find(0.5).any()

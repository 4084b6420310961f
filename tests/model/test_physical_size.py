import pytest

from stereocell.model.physical_size import describe_size, display_scale


@pytest.mark.parametrize(
    ("longest_um", "scale"),
    [
        (67, 10_000),
        (100, 10_000),
        (101, 1000),
        (230_000, 1),
        (1e6, 1),
        (5e6, 1),
        (0, 1),
        (0.5, 1e6),
    ],
)
def test_the_display_scale_is_a_power_of_ten_that_fits_the_specimen_into_a_metre(
    longest_um: float, scale: float
) -> None:
    assert display_scale(longest_um) == scale


@pytest.mark.parametrize(
    ("edges_um", "words"),
    [
        ((67.2, 50, 12.25), "67.2 x 50 x 12.2 um"),
        ((1000, 20, 5), "1 x 0.02 x 0.005 mm"),
        ((182_000, 218_000, 182_000), "182 x 218 x 182 mm"),
        ((1.2e6, 3e5, 1e6), "1.2 x 0.3 x 1 m"),
    ],
)
def test_a_size_is_described_in_the_unit_of_its_longest_edge(
    edges_um: tuple[float, float, float], words: str
) -> None:
    assert describe_size(edges_um) == words

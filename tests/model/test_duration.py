import pytest

from stereocell.model.duration import in_words


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.2, "0 s"),
        (59.4, "59 s"),
        (59.7, "1 min"),
        (61.0, "1 min 1 s"),
        (3599.6, "1 h"),
        (7500.0, "2 h 5 min"),
        (86_399.0, "24 h"),
        (273_000.0, "3 d 4 h"),
    ],
)
def test_durations_are_rounded_to_two_units(seconds: float, words: str) -> None:
    assert in_words(seconds) == words

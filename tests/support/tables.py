"""Write tables as text files, and read the lines in which other tables are refused."""

from pathlib import Path

import pytest

from stereocell.model.errors import SourceError
from stereocell.read.tables import read_table


def csv(tmp_path: Path, text: str, name: str = "t.csv") -> str:
    """Write a table of text, and return its path."""
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def refusal(place: str, key: str = "", wanted: tuple[str, ...] = ()) -> str:
    """Return the line in which a table is refused."""
    with pytest.raises(SourceError) as error:
        read_table(place, key, wanted, "cells")
    message = str(error.value)
    assert "\n" not in message
    assert len(message) < 600
    return message

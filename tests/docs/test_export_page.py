"""The page on export has each ending that `stereocell export` takes, and no other."""

import re
from pathlib import Path

from stereocell.export.write import ENDINGS

PAGE = Path(__file__).parents[2] / "docs" / "export.md"


def test_the_table_of_endings_is_that_of_the_command() -> None:
    text = PAGE.read_text("utf-8")
    rows = text.partition("| ending |")[2].partition("\n\n")[0].splitlines()
    first_cells = [row.split("|")[1] for row in rows if row.startswith("|")]
    found = [ending for cell in first_cells for ending in re.findall(r"`(\.[\w.]+)`", cell)]
    assert sorted(found) == sorted(ENDINGS)

"""Write the table in docs/input-formats.md from each format's row: `make format-table`."""

from pathlib import Path

from stereocell.read.format import Format
from stereocell.read.known_formats import known_formats

PAGE = Path(__file__).parent / "input-formats.md"
BEGIN, END = "<!-- begin of `make format-table` -->\n", "<!-- end of `make format-table` -->\n"
_HEAD = ("format", "input", "flags", "read from it")
_OPTIONS = ("series", "axes", "pattern")


def table() -> str:
    """Return the table, in the order of the formats' titles."""
    rows = [
        (guide.format, _input_of(one, guide.input), _flags_of(one), guide.read)
        for one in known_formats().values()
        for guide in one.guides
    ]
    rows.sort(key=lambda row: row[0].lower())
    lines = [_HEAD, ("---",) * len(_HEAD), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def page(text: str) -> str:
    """Return the text of the page with the table of this version in it."""
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}\n{table()}\n{END}{rest.split(END)[1]}"


def _input_of(format: Format, named: str) -> str:
    address = "; also at an address" if format.is_remote else ""
    install = format.library and f', after `pip install "stereocell[{format.library.extra}]"`'
    return f"{named}{address}{install or ''}"


def _flags_of(format: Format) -> str:
    return ", ".join(f"`--{name}`" for name in _OPTIONS if getattr(format, f"has_{name}"))


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text("utf-8")), encoding="utf-8")

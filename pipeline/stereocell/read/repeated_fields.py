"""Fields that a text header states several times: the last line counts, and a note says so.

ITK, ImageJ and tifffile use the last line of a field as well. pynrrd refuses such a file.
"""

from collections.abc import Iterable, Sequence

from stereocell.read.statements import Statement, Subject, Trust, Value, settle


def settle_repeats(
    lines: Iterable[tuple[str, str]], source: str = "the header"
) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return the text of each field, and a note on each field whose lines disagree.

    lines   (field, text) of the fields that are read, in the order of the file
    source  name of the header, for notes
    """
    found: dict[str, list[str]] = {}
    for name, text in lines:
        found.setdefault(name, []).append(text)
    notes: list[str] = []
    for name, texts in found.items():
        notes += _settle(Subject(f"field {name} of {source}"), texts)
    return {name: texts[-1] for name, texts in found.items()}, tuple(notes)


def value_of(text: str) -> Value:
    """Return a list of numbers as a tuple of floats, and any other text unchanged."""
    try:
        return tuple(float(part) for part in text.replace(",", " ").split()) or ""
    except ValueError:
        return text.strip()


def _settle(subject: Subject, texts: Sequence[str]) -> tuple[str, ...]:
    """Return a note if earlier texts of a field disagree with its last one."""
    last = Statement(value_of(texts[-1]), "its last line")
    earlier = [Statement(value_of(text), "an earlier line", Trust.REPEATED) for text in texts[:-1]]
    return settle(subject, [last, *earlier]).notes

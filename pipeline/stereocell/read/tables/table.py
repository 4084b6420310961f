"""A table as it was read: texts and numbers by row."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError

# Names of the column of objects' numbers in MCMICRO, scikit-image, Cellpose, Xenium, SpatialData
KEYS = ("CellID", "label", "cell_id", "instance_id", "object_id", "ObjectNumber", "id")
MAX_COLUMNS = 128  # columns that are read at most if the user names none
MAX_NAMES = 100_000  # columns; a file with more is refused
MAX_ROWS = 1 << 24
_LONGEST = 200  # characters; a longer category is cut
_SHOWN = 8  # names that a message lists at most
# words for a missing value, in lower case, as in pandas
MISSING = (
    *("", "na", "nan", "n/a", "null", "none", "<na>", "-nan"),
    *("#n/a", "#n/a n/a", "#na", "-1.#ind", "-1.#qnan", "1.#ind", "1.#qnan"),
)
_MAX_DIGITS = 20  # largest power of ten: 64-bit numbers have up to 20 digits


@dataclass(frozen=True, slots=True)
class TableColumn:
    """One column. Exactly one of `numbers` and `texts` is given, with a value per row.

    numbers  float64 (n,); NaN: missing
    texts    (n,); empty: missing
    """

    name: str
    numbers: NDArray[np.float64] | None
    texts: tuple[str, ...] | None


@dataclass(frozen=True, slots=True)
class Table:
    """A table with one row per object.

    shown     name of the file, for messages
    key       name of the column of the objects' numbers
    labels    uint64 (n,): the objects' numbers, without repeats
    left_out  number of columns that are not read
    notes     sentences on how the cells were read
    """

    shown: str
    key: str
    labels: NDArray[np.uint64]
    columns: tuple[TableColumn, ...]
    left_out: int = 0
    notes: tuple[str, ...] = ()


def choose_key(where: str, names: Sequence[str], key: str) -> str:
    """Return the name of the column of the objects' numbers. Raises SourceError."""
    if key:
        if key not in names:
            raise SourceError(f"{where}: no column {key!r:.60}, expected one of {shown(names)}")
        return key
    lower = {name.lower(): name for name in reversed(names)}
    for one in KEYS:
        if one.lower() in lower:
            return lower[one.lower()]
    raise SourceError(
        f"{where}: no column holds the objects' numbers: found {shown(names)}, expected "
        f"{', '.join(KEYS)}, or --table-key COLUMN"
    )


def choose_columns(
    where: str, names: Sequence[str], key: str, wanted: Sequence[str]
) -> tuple[list[str], int]:
    """Return the names of the columns to read, and how many are left out. Raises SourceError."""
    for name in wanted:
        if name not in names:
            raise SourceError(f"{where}: no column {name!r:.60}, expected one of {shown(names)}")
    if wanted:
        return list(wanted), 0
    others = [name for name in names if name != key]
    return others[:MAX_COLUMNS], max(0, len(others) - MAX_COLUMNS)


def keys_of(
    where: str, key: str, values: NDArray[np.float64] | Sequence[str], hint: str = ""
) -> NDArray[np.uint64]:
    """Return the objects' numbers of all rows. Raises SourceError for fractions or repeats.

    hint  end of the message on a value that is not an object's number
    """
    found: list[int] = []
    for row, value in enumerate(values):
        try:
            number = _whole_of(value) if isinstance(value, str) else _whole(float(value))
        except (ValueError, OverflowError):
            number = -1
        if not 0 < number < 1 << 64:
            raise SourceError(
                f"{where}: {key}, row {row + 1}: found {value!s:.40}, expected an object's "
                f"number: a whole number above 0{hint}"
            )
        found.append(number)
    labels = np.array(found, np.uint64)
    unique, counts = np.unique(labels, return_counts=True)
    if (counts > 1).any():
        twice = unique[counts > 1].tolist()
        raise SourceError(
            f"{where}: {key}: found {listed(twice)} more than once ({len(twice)} in all), expected "
            "each object in one row"
        )
    return labels


def require_once(where: str, names: Sequence[str]) -> None:
    """Raise SourceError where two columns have the same name."""
    twice = sorted(name for name, times in Counter(names).items() if times > 1)
    if twice:
        raise SourceError(f"{where}: found columns twice ({shown(twice)}), expected each name once")


def named(names: Sequence[str]) -> list[str]:
    """Return a header's names as they are shown; a column without a name gets its number."""
    return [clean(name) or f"column {place}" for place, name in enumerate(names, start=1)]


def listed(values: Sequence[object]) -> str:
    """Return the first few values, with `...` if there are more."""
    return ", ".join(map(str, values[:5])) + ", ..." * (len(values) > 5)


def shown(names: Sequence[str]) -> str:
    """Return the first names of a list, cleaned and shortened for a message."""
    cut = [f"{clean(name):.40}" for name in names[:_SHOWN]]
    return ", ".join(cut) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")


def word_of(text: str) -> str:
    """Return a category's name for display; empty: missing."""
    return "" if text.strip().lower() in MISSING else clean(text[:_LONGEST])


def clean(name: str) -> str:
    """Return a name for display: without control characters and repeated spaces."""
    return " ".join("".join(c if c.isprintable() else " " for c in name).split())


def _whole_of(text: str) -> int:
    """Return a text's whole number, exact to the last digit even for `9223372036854775807.0`."""
    try:
        return int(text)
    except ValueError:
        pass
    try:
        value = Decimal(text)
    except InvalidOperation:
        raise ValueError from None
    if not value.is_finite() or value.adjusted() > _MAX_DIGITS or value != value // 1:
        raise ValueError
    return int(value)


def _whole(value: float) -> int:
    if value != value // 1:
        raise ValueError
    return int(value)

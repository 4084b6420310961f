"""Convert names to identifiers that are valid in USD paths, file names and URLs, and back.

ASCII letters and digits stay. These characters become `_x<hex>_`:

- all other characters
- a leading digit
- an underscore before an `x`, so that no name looks like an escape
- the first letter of a device name of Windows, such as `con`, which no file can have

`Hoechst 33342` becomes `Hoechst_x20_33342`, `CD3e` with a Greek epsilon `CD3_x3b5_`, `1st`
`_x31_st` and `Con` `_x43_on`.

File names are limited to 255 bytes. So an identifier longer than `MAX_LENGTH` is cut and ends in a
digest of the whole name, `_xh<hex>_`. No other name can have that identifier.
"""

import hashlib
import re
from bisect import bisect_right
from itertools import accumulate

MAX_LENGTH = 180  # characters; leaves room for tile ID, key and suffix in a file name

_ESCAPE = re.compile(r"_x([0-9a-f]+)_|_xh[0-9a-f]{20}_$")
_DEVICE = re.compile(r"(con|prn|aux|nul|(com|lpt)[0-9])", re.IGNORECASE)
_KEPT = re.compile(r"[A-Za-z0-9]|_(?!x)")


def to_identifier(name: str) -> str:
    """Return the identifier of a name. Raises ValueError for an empty name.

    >>> to_identifier("Hoechst 33342")
    'Hoechst_x20_33342'
    """
    if not name:
        raise ValueError("an empty name has no identifier")
    is_device = bool(_DEVICE.fullmatch(name))
    kept = [
        bool(_KEPT.match(name, i)) and not (i == 0 and (char.isdigit() or is_device))
        for i, char in enumerate(name)
    ]
    parts = [c if keep else f"_x{ord(c):x}_" for c, keep in zip(name, kept, strict=True)]
    ends = list(accumulate(len(part) for part in parts))
    if ends[-1] <= MAX_LENGTH:
        return "".join(parts)
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:20]
    shortened = f"_xh{digest}_"
    return "".join(parts[: bisect_right(ends, MAX_LENGTH - len(shortened))]) + shortened


def from_identifier(identifier: str) -> str:
    """Return the name of an identifier; a shortened name ends in `\u2026`."""
    return _ESCAPE.sub(lambda match: chr(int(match[1], 16)) if match[1] else "\u2026", identifier)

"""Channel and tile names as identifiers: legal in USD paths, file names and URLs, and reversible.

ASCII letters and digits stay; each other character becomes `_x<hex>_`, as do a leading digit and
an underscore that stands before an `x` (so that no name can imitate an escape). `Hoechst 33342`
becomes `Hoechst_x20_33342`, `CD3e` with a Greek epsilon `CD3_x3b5_`, `1st` becomes `_x31_st`.
"""

import re

_ESCAPE = re.compile(r"_x([0-9a-f]+)_")
_KEPT = re.compile(r"[A-Za-z0-9]|_(?!x)")


def to_identifier(name: str) -> str:
    """Return the identifier of a non-empty name. Raises ValueError for an empty one."""
    if not name:
        raise ValueError("an empty name has no identifier")
    kept = [
        bool(_KEPT.match(name, i)) and not (i == 0 and char.isdigit())
        for i, char in enumerate(name)
    ]
    return "".join(c if keep else f"_x{ord(c):x}_" for c, keep in zip(name, kept, strict=True))


def from_identifier(identifier: str) -> str:
    """Return the name that `to_identifier` was given."""
    return _ESCAPE.sub(lambda match: chr(int(match[1], 16)), identifier)

"""Convert texts that a file states. HDF5 and JSON may hold a text as bytes, or in a list of one."""

from typing import Any

import numpy as np


def text_of(value: Any) -> str:
    """Return a stated text without surrounding blanks; empty: the value is not a single text.

    >>> text_of(b" um "), text_of(["um"]), text_of(["um", "nm"]), text_of(3)
    ('um', 'um', '', '')
    """
    if isinstance(value, list | tuple | np.ndarray) and np.size(value) == 1:
        return text_of(np.ravel(np.asarray(value, dtype=object))[0])
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    return value.strip(" \0\t\r\n") if isinstance(value, str) else ""

"""Read values of a composed stage, and check that they have the expected type.

A layer over the stage may hold a value of any type: USD does not mind a text where the stage has a
colour. All readers get values from `read_as`. For a value of another type, or a number that is not
finite, it raises an error of one line, which names the attribute.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Tf, Usd, UsdUtils, Vt

from stereocell.model.errors import StageError

_TEXTS = (Vt.StringArray, Vt.TokenArray)


def read_as(
    attribute: Usd.Attribute | None, expected: Sdf.ValueTypeName, *, may_be_nan: bool = False
) -> Any:  # the type depends on the attribute
    """Return an attribute's value at the default time; None: it has no value.

    expected    expected type; another precision is accepted, and an integer instead of a float
    may_be_nan  whether NaN and infinite numbers are accepted

    Raises StageError for a value of another type.
    """
    if not attribute:
        return None
    try:
        value = attribute.Get()
    except Tf.ErrorException as error:
        raise StageError(
            f"{attribute.GetPath()}: can't be read, expected a value of type {expected}: "
            f"{one_line(error)}"
        ) from error
    if value is not None:
        require_type(attribute.GetPath(), value, expected, may_be_nan=may_be_nan)
    return value


def text_of(attribute: Usd.Attribute | None) -> str:
    """Return an attribute's text; empty: it has no value. Raises StageError for another type."""
    return str(read_as(attribute, Sdf.ValueTypeNames.String) or "")


def require_type(
    where: object, value: object, expected: Sdf.ValueTypeName, *, may_be_nan: bool = False
) -> None:
    """Raise StageError unless a value has the expected type; see `read_as`.

    where  path of the attribute, for the message
    """
    if not _is_of(value, expected):
        found = Sdf.GetValueTypeNameForValue(value) or type(value).__name__
        raise StageError(f"{where}: found a value of type {found}, expected {expected}")
    if may_be_nan or not _is_number(expected):
        return
    numbers = np.asarray(value, np.float64)
    is_finite = np.isfinite(numbers)
    if not is_finite.all():
        found = numbers[~is_finite].flat[0]
        raise StageError(f"{where}: found {found:g}, expected finite numbers ({expected})")


def _is_of(value: object, expected: Sdf.ValueTypeName) -> bool:
    sample = expected.scalarType.defaultValue
    if isinstance(sample, str):
        return isinstance(value, _TEXTS if expected.isArray else str)
    if not _is_number(expected):
        return isinstance(value, Vt.AssetArray if expected.isArray else type(sample))
    if isinstance(value, (str, bool, *_TEXTS)):
        return False
    numbers = np.asarray(value)
    kinds = "iu" if np.asarray(sample).dtype.kind in "iu" else "iuf"
    rows = numbers.shape[1:] if expected.isArray else numbers.shape
    return (
        numbers.dtype.kind in kinds
        and rows == np.shape(sample)
        and numbers.ndim == expected.isArray + np.ndim(sample)
    )


def _is_number(expected: Sdf.ValueTypeName) -> bool:
    return np.asarray(expected.scalarType.defaultValue).dtype.kind in "iuf"


@contextmanager
def usd_boundary(stage_path: Path) -> Iterator[None]:
    """Turn an error that USD raises inside the block into a StageError of one line.

    Warnings of USD are not shown, since our own messages report what is wrong with a stage.
    """
    quiet = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    except Tf.ErrorException as error:
        raise StageError(
            f"{stage_path}: found an error of USD ({one_line(error)}), expected a valid stage: "
            "correct your layer, or run `stereocell stage OUT` again"
        ) from error
    finally:
        del quiet


def one_line(error: object) -> str:
    """Return USD's message of an error, without line breaks and locations in USD's source."""
    args = error.args if isinstance(error, Tf.ErrorException) else ()
    try:
        text = "; ".join(entry.commentary for entry in args) or str(error)
    except UnicodeDecodeError:  # the message quotes bytes that are not text
        text = "a layer or one of its files is damaged"
    return " ".join(text.split()).removesuffix(".")

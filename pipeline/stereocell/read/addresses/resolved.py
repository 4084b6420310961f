"""The data that an address leads to, and the errors for addresses."""

from collections.abc import Sequence
from dataclasses import dataclass

from stereocell.model.errors import SourceError, UsageError


@dataclass(frozen=True, slots=True)
class Resolved:
    """The data behind an address.

    source  address or folder that a reader opens
    notes   sentences on how it was found
    """

    source: str
    notes: tuple[str, ...] = ()


class NotThereError(SourceError):
    """A server answers that it has nothing at an address."""


def other_form(shown: str, service: str, forms: Sequence[str]) -> UsageError:
    """Return the error for a service's address in an unknown form."""
    return UsageError(
        f"{shown}: found another form of an address of {service}, expected {' or '.join(forms)}"
    )


def wrong_answer(shown: str, found: str, expected: str) -> SourceError:
    """Return the error for an answer that doesn't have the documented form."""
    return SourceError(f"{shown}: the server's answer: found {found}, expected {expected}")

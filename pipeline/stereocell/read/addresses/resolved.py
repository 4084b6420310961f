"""The data that an address leads to, and the errors of addresses."""

from collections.abc import Sequence
from dataclasses import dataclass

from stereocell.model.errors import SourceError, UsageError


@dataclass(frozen=True, slots=True)
class Resolved:
    """The data behind an address.

    source  the address or the folder that a reader opens
    notes   how it was found, a sentence each
    """

    source: str
    notes: tuple[str, ...] = ()


class NotThereError(SourceError):
    """A server answers that it has nothing at an address."""


def other_form(shown: str, service: str, forms: Sequence[str]) -> UsageError:
    """Return the error of an address of a service in a form that is not understood."""
    return UsageError(
        f"{shown}: an address of {service} in another form, expected {' or '.join(forms)}"
    )


def wrong_answer(shown: str, found: str, expected: str) -> SourceError:
    """Return the error of an answer that is not in the documented form."""
    return SourceError(f"{shown}: the server's answer: found {found}, expected {expected}")

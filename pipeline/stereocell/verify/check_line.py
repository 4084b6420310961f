"""One line of a check's result, and errors that combine several problems."""

from dataclasses import dataclass

from stereocell.model.errors import CheckError

_MAX_SHOWN = 3  # problems printed in one line


@dataclass(frozen=True, slots=True)
class CheckLine:
    """One line of the result of a check.

    detail  text on the parts that were checked, or on the problem
    """

    name: str
    ok: bool
    detail: str


def raise_on_all(problems: list[str], remedy: str) -> None:
    """Raise CheckError with all of the problems, if there are any."""
    if problems:
        raise CheckError(f"{'; '.join(problems)}: {remedy}")


def raise_on(problems: list[str]) -> None:
    """Raise CheckError with the first few of the problems, if there are any."""
    if problems:
        more = f" (and {len(problems) - _MAX_SHOWN} more)" if len(problems) > _MAX_SHOWN else ""
        raise CheckError("; ".join(problems[:_MAX_SHOWN]) + more)

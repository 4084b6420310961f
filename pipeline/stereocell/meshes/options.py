"""Settings of the levels of detail."""

from dataclasses import dataclass

from stereocell.model.errors import UsageError
from stereocell.model.settings import setting


@dataclass(frozen=True, slots=True)
class LodOptions:
    """How levels of detail are made.

    Raises UsageError unless the errors are positive and rise, and samples are at least 1.
    """

    errors: tuple[float, ...] = setting(
        (0.1, 0.35, 1.1, 4.0),
        "aim of simplifying to lod0, lod1, ..., in finest spacings; what comes out is measured",
    )
    samples: int = setting(1000, "points at which distances are measured, each way")

    def __post_init__(self) -> None:
        if not self.errors or list(self.errors) != sorted(self.errors) or self.errors[0] <= 0:
            raise UsageError(f"lod.errors is {list(self.errors)}, expected rising positive numbers")
        if self.samples < 1:
            raise UsageError(f"lod.samples is {self.samples}, expected 1 or more")

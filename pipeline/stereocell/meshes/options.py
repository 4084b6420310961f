"""Settings of the levels of detail."""

from dataclasses import dataclass

from stereocell.model.errors import UsageError
from stereocell.model.settings import Bounds, require_bounds, setting

# Largest allowed error, in finest voxel spacings; such an error leaves only a surface's box
MAX_ERROR = 1e6
MAX_SAMPLES = 10_000_000  # largest number of points; their distances take a gigabyte


@dataclass(frozen=True, slots=True)
class LodOptions:
    """How levels of detail are made.

    Raises UsageError unless the errors are positive and rise, and samples are at least 1.
    """

    errors: tuple[float, ...] = setting(
        (0.1, 0.35, 1.1, 4.0),
        "largest errors of lod0, lod1, ... in finest spacings; actual distances are measured",
        bounds=Bounds(0, MAX_ERROR),
    )
    samples: int = setting(
        1000, "points for measuring distances, in each direction", bounds=Bounds(1, MAX_SAMPLES)
    )

    def __post_init__(self) -> None:
        if not self.errors or list(self.errors) != sorted(self.errors) or self.errors[0] <= 0:
            raise UsageError(f"lod.errors is {list(self.errors)}, expected rising positive numbers")
        require_bounds("lod", self)

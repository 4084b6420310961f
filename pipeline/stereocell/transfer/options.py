"""Settings of a channel's window."""

from dataclasses import dataclass

from stereocell.model.errors import UsageError
from stereocell.model.settings import Bounds, require_bounds, setting


@dataclass(frozen=True, slots=True)
class WindowOptions:
    """The voxel values that become 0 and 255 in the whole dataset.

    Raises UsageError unless 0 <= low < high <= 100.
    """

    low_percentile: float = setting(
        0.5, "percent of the voxels that become 0", bounds=Bounds(0, 100)
    )
    high_percentile: float = setting(
        99.95, "percent of the voxels that stay below 255", bounds=Bounds(0, 100)
    )

    volume_percentile: float = setting(
        99.0,
        "percent of the voxels that are too faint to show in the volume of a channel without a "
        "surface",
        bounds=Bounds(1, 100),
    )

    def __post_init__(self) -> None:
        require_bounds("window", self)
        if not 0 <= self.low_percentile < self.high_percentile <= 100:
            raise UsageError(
                f"window percentiles are {self.low_percentile:g} and {self.high_percentile:g}, "
                "expected 0 <= low < high <= 100"
            )

"""What a format's reader hands over: arrays and metadata, before names and spacings are settled."""

from collections.abc import Callable
from dataclasses import dataclass

from stereocell.model.rigid_transform import IDENTITY, Matrix
from stereocell.read.dataset import VoxelArray
from stereocell.read.spacing import Grid

Color = tuple[float, float, float]
MAX_CHANNELS = 10_000


@dataclass(frozen=True, slots=True)
class Image:
    """The first image of a source.

    arrays, grids  one for each level, finest first
    names, colors  one for each channel; None: not said. Colours are linear RGB, 0..1
    images         how many the source holds
    close          frees open files, or None
    title          what the image is called in place of its file's name; None: by the file
    modality, placement, notes  as in Dataset, whose `remarks` the notes are
    notes_at       more notes, of one point in time; may read its voxels
    """

    arrays: tuple[VoxelArray, ...]
    grids: tuple[Grid, ...]
    names: tuple[str | None, ...]
    colors: tuple[Color | None, ...]
    images: int
    close: Callable[[], None] | None = None
    title: str | None = None
    modality: str = ""
    placement: Matrix = IDENTITY
    notes: tuple[str, ...] = ()
    notes_at: Callable[[int], tuple[str, ...]] | None = None


def linear_color(rgb: tuple[int, int, int]) -> Color:
    """Return linear RGB, 0..1, of sRGB bytes (IEC 61966-2-1)."""
    red, green, blue = (_linear(value / 255.0) for value in rgb)
    return red, green, blue


def _linear(value: float) -> float:
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4

"""A reader's result: arrays and metadata, before names and spacings are settled."""

from collections.abc import Callable
from dataclasses import dataclass

from stereocell.model.object_notes import ObjectNotes
from stereocell.model.rigid_transform import IDENTITY, Matrix
from stereocell.read.acquired import Acquired
from stereocell.read.dataset import VoxelArray
from stereocell.read.spacing import Grid

Color = tuple[float, float, float]
RGB_NAMES = ("Red", "Green", "Blue")  # names of the channels of colour pixels
# linear RGB, 0..1
RGB_COLORS: tuple[Color, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
MAX_CHANNELS = 10_000  # a source with more channels is refused


@dataclass(frozen=True, slots=True)
class Image:
    """The chosen image of a source, as its reader returns it.

    arrays, grids  one for each level, finest first
    names, colors  one for each channel; None: not stated. Colours are linear RGB, 0..1
    images         the number of images in the source
    close          closes open files; None: none are open
    title          the image's name; None: the file's name is used
    modality, has_hounsfield_units, placement, has_sides, acquired, labels, objects  as in Dataset
    notes          notes for the user, which become Dataset's `remarks`
    files          paths or addresses of all files and folders that are read; empty: the source
    notes_at       returns further notes about one time point; it may read that point's voxels
    at_time        returns the image at one time point, where channels or spacing depend on the
                   time; called once, before anything else uses the image
    """

    arrays: tuple[VoxelArray, ...]
    grids: tuple[Grid, ...]
    names: tuple[str | None, ...]
    colors: tuple[Color | None, ...]
    images: int
    close: Callable[[], None] | None = None
    title: str | None = None
    modality: str = ""
    has_hounsfield_units: bool = True
    placement: Matrix = IDENTITY
    has_sides: bool = False
    acquired: Acquired = Acquired()  # noqa: RUF009  (frozen)
    labels: str = ""
    objects: ObjectNotes = ObjectNotes()  # noqa: RUF009  (frozen)
    notes: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    notes_at: Callable[[int], tuple[str, ...]] | None = None
    at_time: Callable[["Image", int], "Image"] | None = None


def printable(name: str) -> str:
    """Return a name without unprintable characters (controls, NUL, line ends)."""
    if name.isprintable():
        return name
    return " ".join("".join(c if c.isprintable() else " " for c in name).split())

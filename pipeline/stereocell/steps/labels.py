"""A label map of a build: its voxels, and where it lies on the image."""

from collections.abc import Sequence
from dataclasses import dataclass

from stereocell.engine.step import content_of
from stereocell.model.identifiers import to_identifier
from stereocell.read.label_map import LabelMap
from stereocell.steps.open_source import SourceRef, open_source

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class LabelVoxels:
    """The voxels of a label map.

    channel     index in the source
    background  label of voxels without an object, besides 0; 0: there is no other
    """

    ref: SourceRef
    channel: int
    background: int

    def open(self) -> LabelMap:
        """Return the label map. Raises SourceError."""
        return LabelMap(open_source(self.ref), self.channel, self.background)


@dataclass(frozen=True, slots=True)
class Labels:
    """A label map of a build, which is a channel besides the image's. Its finest level is built.

    ref         how it is opened, with its fingerprint when the plan was made
    channel     index in the source
    spacing_um  voxel spacing (z, y, x), um
    origin_um   centre of its voxel (0, 0, 0) from that of the image's, (z, y, x) in um
    shape       voxels (z, y, x)
    color       linear RGB, 0..1, of objects without a colour of their own
    background  label of voxels without an object, besides 0; 0: there is no other
    """

    name: str
    ref: SourceRef
    channel: int
    spacing_um: Triple
    origin_um: Triple
    shape: tuple[int, int, int]
    color: Triple
    background: int = 0

    @property
    def id(self) -> str:
        """The name as an identifier, for paths and prims."""
        return to_identifier(self.name)

    @property
    def voxels(self) -> LabelVoxels:
        """The voxels without their place on the image."""
        return LabelVoxels(self.ref, self.channel, self.background)

    def key_content(self) -> list[object]:
        """Return the content for a key: the voxels and their place, but not name and colour."""
        return [content_of(self.voxels), self.spacing_um, self.origin_um]

    def open(self) -> LabelMap:
        """Return the label map. Raises SourceError."""
        return self.voxels.open()

    def position_um(self, index_zyx: Sequence[float]) -> Triple:
        """Return the position of a voxel's centre, (z, y, x) in um, like a plan's `position_um`."""
        places = zip(self.origin_um, index_zyx, self.spacing_um, strict=True)
        z, y, x = (float(o + i * s) for o, i, s in places)
        return z, y, x

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
    background  number of the voxels that are no object, beside 0; 0: there is no other
    """

    ref: SourceRef
    channel: int
    background: int

    def open(self) -> LabelMap:
        """Return the label map. Raises SourceError."""
        return LabelMap(open_source(self.ref), self.channel, self.background)


@dataclass(frozen=True, slots=True)
class Labels:
    """A label map of a build, a channel beside the image's. Its finest level is what is built.

    ref         how it is opened, with the fingerprint that it had
    channel     index in the source
    spacing_um  (z, y, x), um
    origin_um   (z, y, x), um: centre of its voxel (0, 0, 0), from that of the image's
    shape       voxels (z, y, x)
    color       linear RGB 0..1, of objects without one of their own
    background  number of the voxels that are no object, beside 0; 0: there is no other
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
        """The voxels, which lie nowhere by themselves."""
        return LabelVoxels(self.ref, self.channel, self.background)

    def key_content(self) -> list[object]:
        """Return what counts in a key: the voxels and their place, neither name nor colour."""
        return [content_of(self.voxels), self.spacing_um, self.origin_um]

    def open(self) -> LabelMap:
        """Return the label map. Raises SourceError."""
        return self.voxels.open()

    def position_um(self, index_zyx: Sequence[float]) -> Triple:
        """Return the place of a voxel's centre, (z, y, x) in um, as a plan's `position_um`."""
        places = zip(self.origin_um, index_zyx, self.spacing_um, strict=True)
        z, y, x = (float(o + i * s) for o, i, s in places)
        return z, y, x

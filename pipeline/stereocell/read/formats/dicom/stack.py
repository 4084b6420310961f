"""A stack of DICOM frames: one orientation and one kind, at one or several time points."""

from dataclasses import dataclass

import numpy as np

from stereocell.read.anatomical_axes import plane_name
from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.plane_stack import StackLayout, normal_of


@dataclass(frozen=True, slots=True)
class Stack:
    """Frames of one orientation and kind.

    times    frames along the normal for each time point; each time point has the same number
    layout   grid of the planes; None: they don't form a volume, and `problem` gives the reason
    notes    changes and omissions, a sentence each
    words    words that separate it from other stacks of the series, such as `magnitude`
    order    key that sorts it among those: rank of its kind, rank of its contrast, other values
    among    key that sorts its series among others of the same size
    elsewhere  sentences on other images of the series that lie beside these; empty: there are none
    """

    times: tuple[tuple[Frame, ...], ...]
    layout: StackLayout | None
    problem: str
    notes: tuple[str, ...]
    words: tuple[str, ...] = ()
    order: tuple[int, ...] = ()
    elsewhere: tuple[str, ...] = ()
    among: tuple[int, ...] = ()

    @property
    def first(self) -> Frame:
        """The first frame of the first time point."""
        return self.times[0][0]

    @property
    def frames(self) -> int:
        """The number of frames."""
        return sum(map(len, self.times))

    @property
    def rank(self) -> int:
        """Order in which stacks are shown, lowest first."""
        return self.order[0] if self.order else 0

    @property
    def voxels(self) -> int:
        """The number of voxels of the volume; without a volume, the number of pixels."""
        if self.layout is not None:
            return int(np.prod(self.layout.shape, dtype=np.int64))
        return len(self.times[0]) * self.first.rows * self.first.columns

    @property
    def label(self) -> str:
        """Modality, kind, orientation, size and spacing, without any description from the file."""
        frame = self.first
        normal = normal_of(frame.along_row, frame.along_column)
        segment = f", segment {frame.segment}" if frame.segment else ""
        kind = "".join(f", {word}" for word in self.words)
        name = f"{frame.modality or 'DICOM'}{segment}{kind}, {plane_name(normal)}"
        planes = len(self.times[0]) if self.layout is None else self.layout.shape[0]
        size = f"{planes} x {frame.rows} x {frame.columns}"
        if self.layout is None:
            return f"{name}, {size}: no volume ({self.problem})"
        spacing = " x ".join(f"{value:.4g}" for value in self.layout.spacing_mm)
        times = f", {len(self.times)} time points" if len(self.times) > 1 else ""
        return f"{name}, {size} voxels (slices, rows, columns), {spacing} mm{times}"

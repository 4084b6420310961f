"""Draw all pictures of one unit for the report: its slices, other iso-values, its threshold."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stereocell.model.lattice_field import LatticeField
from stereocell.model.spacing import Point, Spacing
from stereocell.model.tile_content import APRON
from stereocell.model.tiling import Box
from stereocell.preview.draw_slices import (
    Slice,
    cut_contour,
    cut_middle_planes,
    cut_unit,
    draw_slices,
)
from stereocell.preview.views import MICROSCOPE, View
from stereocell.report.draw_scenes import Picture, Scene, draw_scene
from stereocell.steps.unit_files import (
    load_lod,
    load_volume,
    lod_file,
    record_file,
    volume_file,
)
from stereocell.storage.workspace import cached


@dataclass(frozen=True, slots=True)
class DrawnIso:
    """An iso-value of a channel, voxel values.

    background  what is subtracted from the voxels before the comparison; None: nothing
    window      least and largest voxel value of the stored 8 bits
    """

    iso: LatticeField
    background: LatticeField | None
    window: tuple[float, float]

    def at(self, box: Box) -> NDArray[np.float32]:
        """Return the iso-value on the scale of 8 bits: float32, the shape of the box."""
        low, high = self.window
        iso = self.iso.at(box)
        level = iso if self.background is None else iso + self.background.at(box)
        return (np.broadcast_to(level, box.shape) - np.float32(low)) * np.float32(
            255 / (high - low)
        )


@dataclass(frozen=True, slots=True)
class UnitPictures:
    """The pictures to draw of one unit.

    directory    folder of the unit's results
    lattice      the unit's box in voxels of the dataset
    first_um     (z, y, x), um, centre of the first voxel
    sigma_um     sigma of the Gaussian before surface extraction
    has_slices   whether its slices are drawn, with its surface if `has_surface`
    level        the channel's iso-value, for the dashed line; None: there is none
    others       other iso-values, each drawn as a contour on slices
    threshold    0..1 in the window; slices without voxels below it are drawn; None: no such picture
    """

    directory: Path
    lattice: Box
    first_um: Point
    spacing_um: Spacing
    sigma_um: float
    views: tuple[View, View, View]
    has_slices: bool
    has_surface: bool
    level: DrawnIso | None
    others: tuple[DrawnIso, ...]
    threshold: float | None

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The files of the unit that are drawn."""
        voxels = record_file(self.directory), volume_file(self.directory)
        return (*voxels, *self._surface())

    def _surface(self) -> tuple[Path, ...]:
        is_drawn = self.has_slices and self.has_surface
        return (lod_file(self.directory, 0),) if is_drawn else ()


@dataclass(frozen=True, slots=True)
class DrawnUnit:
    """The pictures of one unit; see `UnitPictures`."""

    slices: Picture | None
    others: tuple[Picture, ...]
    threshold: Picture | None


def draw(wanted: Scene | UnitPictures) -> Picture | DrawnUnit:
    """Draw the pictures of a scene or of a unit. Runs on a worker."""
    with cached(*wanted.inputs):
        return draw_scene(wanted) if isinstance(wanted, Scene) else draw_unit(wanted)


def draw_unit(wanted: UnitPictures) -> DrawnUnit:
    """Draw the pictures of a unit. Raises OutputError if one of its files is damaged."""
    inner = slice(APRON, -APRON)
    volume = load_volume(wanted.directory)[inner, inner, inner]
    slices: Picture | None = None
    others: tuple[Picture, ...] = ()
    if wanted.has_slices or wanted.others:
        planes = cut_middle_planes(
            volume,
            wanted.lattice,
            spacing_um=wanted.spacing_um,
            sigma_um=wanted.sigma_um,
            views=wanted.views,
        )
        others = tuple(Picture(*draw_slices(cut_contour(planes, one.at))) for one in wanted.others)
    if wanted.has_slices:
        cut = cut_unit(
            planes,
            first_um=wanted.first_um,
            spacing_um=wanted.spacing_um,
            mesh=load_lod(wanted.directory, 0).mesh if wanted.has_surface else None,
            iso_at=None if wanted.level is None else wanted.level.at,
        )
        slices = Picture(*draw_slices(cut))
    threshold = None
    if wanted.threshold is not None:
        threshold = draw_cut(volume, wanted.spacing_um, wanted.threshold, views=wanted.views)
    return DrawnUnit(slices, others, threshold)


def draw_cut(
    volume: NDArray[np.uint8],
    spacing_um: Spacing,
    threshold: float,
    *,
    views: Sequence[View] = MICROSCOPE,
) -> Picture:
    """Return a picture of a volume's middle slices, with voxels below the threshold in black.

    volume     uint8 (z, y, x), windowed
    threshold  0..1 in the window
    views      directions of the slices
    """
    slices = []
    for view in views:
        order = view.order
        plane = view.plane(volume.transpose(order)[volume.shape[order[0]] // 2])
        grey = np.where(plane >= 255 * threshold, plane, 0).astype(np.uint8)
        spacing = (spacing_um[order[1]], spacing_um[order[2]])
        slices.append(Slice(view, grey, spacing, np.zeros((0, 2, 2)), None))
    return Picture(*draw_slices(slices))

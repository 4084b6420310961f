"""Read the cameras that a user's layers add to a stage. They become named views in the viewer.

The viewer's camera is always upright, so a camera's roll is lost. It orbits the point of the
camera's axis that is nearest to the specimen's middle. The three cameras of the build are left out:
they frame the whole specimen, which the viewer does by itself.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from stereocell.model.errors import StageError
from stereocell.usd.drawn_prims import is_visible, to_world
from stereocell.usd.layer_opinions import defined_prims
from stereocell.usd.read_attributes import Point, numbers_of
from stereocell.usd.specimen import specimen_of

_MAX_ROLL_DEG = 1.0  # degrees; a roll up to this angle is not noticed
_OF_BUILD = ("mono", "left", "right")


@dataclass(frozen=True, slots=True)
class StageView:
    """A named view of the viewer, made from a camera. Points (x, y, z) are in um of the world.

    target    point that the viewer's camera orbits
    fov_deg   vertical field of view, degrees
    roll_deg  rotation of the camera about its axis, degrees; the viewer ignores it
    """

    name: str
    position: Point
    target: Point
    fov_deg: float
    roll_deg: float = 0.0


def is_view(prim: Usd.Prim) -> bool:
    """Return whether a prim is a camera other than those of the build."""
    if not prim.IsA(UsdGeom.Camera):
        return False
    is_beside = prim.GetPath().GetParentPath() == specimen_of(prim.GetStage()).cameras
    return not (is_beside and prim.GetName() in _OF_BUILD)


def read_views(
    stage: Usd.Stage, low: NDArray[np.float64], high: NDArray[np.float64]
) -> Iterator[StageView]:
    """Yield the views of a stage's visible cameras, in the stage's order.

    low, high  corners of the specimen's box (x, y, z), um, world

    Raises StageError for a camera without a focal length or aperture, or with an animated place.
    """
    middle, longest = (low + high) / 2, float((high - low).max())
    for prim in defined_prims(stage):
        if is_view(prim) and is_visible(prim):
            yield _view_of(prim, middle, longest)


def _view_of(prim: Usd.Prim, middle: NDArray[np.float64], longest: float) -> StageView:
    (focal,), (aperture,) = (
        numbers_of(prim, name, 1) for name in ("focalLength", "verticalAperture")
    )
    if not focal > 0 or not aperture > 0:
        raise StageError(
            f"{prim.GetPath()}: found focalLength {focal:g} and verticalAperture {aperture:g}, "
            "expected both above 0"
        )
    matrix = to_world(prim)
    eye = matrix[3, :3]
    right, forward = _unit(matrix[0, :3]), -_unit(matrix[2, :3])
    ahead = float((middle - eye) @ forward)
    target = eye + forward * (ahead if ahead > 0 else longest)
    fov = 2 * np.degrees(np.arctan(aperture / (2 * focal)))
    # The right-hand axis of an upright camera is horizontal.
    roll = np.degrees(np.arcsin(np.clip(right[1], -1, 1)))
    name = str(prim.GetDisplayName() or prim.GetName())
    return StageView(name, _point(eye), _point(target), round(float(fov), 4), float(roll))


def notes_on_rolls(views: list[StageView]) -> Iterator[str]:
    """Yield a message for each camera that loses a visible roll."""
    for view in views:
        if abs(view.roll_deg) > _MAX_ROLL_DEG:
            yield (
                f"roll of camera {view.name!r}, {view.roll_deg:.0f} degrees, is not taken over: "
                "the viewer keeps the up axis vertical"
            )


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(vector / np.linalg.norm(vector))


def _point(values: NDArray[np.float64]) -> Point:
    x, y, z = (round(float(value), 4) for value in values)
    return x, y, z

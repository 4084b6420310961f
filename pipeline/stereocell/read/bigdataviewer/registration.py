"""Apply the registration of a BigDataViewer view: a scale, a mirror and an order of axes.

A view has several transforms; the first one listed is applied last. Together they lead from voxels
(x, y, z) of level 0 to the world. The world's unit is that of `voxelSize`, or, in files of
BigStitcher, one voxel of the smallest size of all setups. A registration without a scale, such as
the identity or only a mirror, states no spacing. Rotation and shear are not applied: the view is
read as acquired, and a note says so.

References: https://imagej.net/plugins/bdv/, package mpicbg.spim.data.registration
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from stereocell.read.bigdataviewer.described import Described, Matrix, Setup
from stereocell.read.image import Image
from stereocell.read.spacing import Grid, Triple
from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.read.turn import Turn, turned_image

_SKEW = 1e-3  # cosine between two axes; a smaller one is due to rounding
_ALMOST = 0.05  # relative difference of the smallest scale from 1, in a world that counts voxels
_TOLERANCE = 5e-3  # relative difference of two spacings that needs no note
_SHIFT = 0.5  # voxels by which the channels of a view may be shifted without a note


@dataclass(frozen=True, slots=True)
class Parts:
    """The parts of a registration.

    scale      lengths of the matrix columns for (x, y, z)
    turn       order and direction of the axes
    angle_deg  remaining rotation; 0: none
    shear_deg  largest deviation of the angle between two axes from 90 degrees; 0: none
    """

    scale: tuple[float, float, float]
    turn: Turn
    angle_deg: float = 0.0
    shear_deg: float = 0.0


def decompose(matrix: Matrix) -> Parts | None:
    """Return the parts of a registration; None: its axes don't span three dimensions."""
    linear = matrix[:3, :3]
    lengths = np.linalg.norm(linear, axis=0)
    if not np.isfinite(matrix).all() or lengths.min() <= 0:
        return None
    unit = linear / lengths
    if abs(np.linalg.det(unit)) < _SKEW:
        return None
    cosines = unit.T @ unit - np.eye(3)
    shear = math.degrees(math.asin(min(float(np.abs(cosines).max()), 1.0)))
    best = max(permutations(range(3)), key=lambda p: sum(abs(unit[i, p[i]]) for i in range(3)))
    signs = [unit[world, stored] < 0 for world, stored in enumerate(best)]
    # World axes x, y, z are needed in the order z, y, x, where stored axis k becomes axis 2 - k.
    z, y, x = (2 - best[world] for world in (2, 1, 0))
    turn = Turn((z, y, x), (bool(signs[2]), bool(signs[1]), bool(signs[0])))
    nearest = np.zeros((3, 3))
    for world, stored in enumerate(best):
        nearest[world, stored] = -1.0 if signs[world] else 1.0
    left = unit @ nearest.T
    angle = math.degrees(math.acos(np.clip((np.trace(left) - 1) / 2, -1.0, 1.0)))
    sx, sy, sz = (float(length) for length in lengths)
    is_turned = np.abs(left - np.eye(3)).max() > _SKEW
    return Parts(
        (sx, sy, sz),
        turn,
        angle if is_turned else 0.0,
        shear if np.abs(cosines).max() > _SKEW else 0.0,
    )


def registered(image: Image, described: Described, setups: Sequence[int], time: int) -> Image:
    """Return an image with the spacing and axes of its registration. Its channels are the setups.

    time  number of the time point
    """
    own = described.setups.get(setups[0])
    matrix = described.registrations.get((time, setups[0]))
    if own is None or matrix is None or np.allclose(matrix[:3, :3], np.eye(3), atol=_SKEW):
        return replace(image, notes=(*image.notes, *_channel_notes(described, setups, time)))
    parts = decompose(matrix)
    if parts is None:
        note = "the axes of the view's registration don't span three dimensions: it is not applied"
        return replace(image, notes=(*image.notes, note))
    spacing, spacing_notes = _spacing(own, parts, _voxel_of_world(described, time))
    before = image.grids[0].spacing_um
    grids = tuple(_scaled(grid, before, spacing, parts, own) for grid in image.grids)
    notes = (*spacing_notes, *_turn_notes(parts), *_channel_notes(described, setups, time))
    found = replace(image, grids=grids, notes=(*image.notes, *notes))
    is_plain = not parts.angle_deg and not parts.shear_deg
    return turned_image(found, parts.turn if is_plain else _unturned(matrix, parts))


def _voxel_of_world(described: Described, time: int) -> float | None:
    """Return the length of a voxel, um, where the world counts voxels; None: it counts lengths.

    The world counts voxels where the smallest scale of all setups is 1.
    """
    placed = [one for (at, _), one in described.registrations.items() if at == time]
    smallest = min(float(np.linalg.norm(one[:3, :3], axis=0).min()) for one in placed)
    sizes = [min(one.spacing_um) for one in described.setups.values() if one.spacing_um is not None]
    return min(sizes) if sizes and abs(smallest - 1.0) <= _ALMOST else None


def _spacing(
    setup: Setup, parts: Parts, voxel_um: float | None
) -> tuple[Triple | None, tuple[str, ...]]:
    """Return the spacing (z, y, x), um, and notes; None: no unit of length is stated.

    voxel_um  result of `_voxel_of_world`
    """
    if setup.spacing_um is None or setup.unit_um is None:
        return None, ()
    if np.allclose(parts.scale, 1.0, atol=_SKEW):
        return setup.spacing_um, ()
    unit = setup.unit_um if voxel_um is None else voxel_um
    chosen, notes = [], list[str]()
    for axis, stated, scale in zip("zyx", setup.spacing_um, reversed(parts.scale), strict=True):
        subject = Subject(f"voxel spacing along {axis}", "um", _TOLERANCE)
        own = Statement(stated, "voxelSize")
        found = settle(subject, [own, Statement(scale * unit, "the registration", Trust.MEASURED)])
        chosen.append(found.number if found.notes else stated)
        notes += found.notes
    z, y, x = chosen
    return (z, y, x), tuple(notes)


def _scaled(
    grid: Grid, before: Triple | None, after: Triple | None, parts: Parts, setup: Setup
) -> Grid:
    """Return a level's grid with the spacing of the registration."""
    if after is None or grid.spacing_um is None or before is None:
        x, y, z = parts.scale
        hint = f"the registration has {z:.5g},{y:.5g},{x:.5g} (z,y,x) without a unit"
        return replace(grid, hint=hint if setup.spacing_um is None else "")
    z, y, x = (
        length if new == old else length * new / old
        for length, new, old in zip(grid.spacing_um, after, before, strict=True)
    )
    return replace(grid, spacing_um=(z, y, x))


def _unturned(matrix: Matrix, parts: Parts) -> Turn:
    """Return the turn of a view that is read as acquired: only a mirroring is undone."""
    if np.linalg.det(matrix[:3, :3]) > 0:
        return Turn()
    mirrored = next((axis for axis, flip in enumerate(parts.turn.flips) if flip), 2)
    stored = parts.turn.order[mirrored]
    z, y, x = (axis == stored for axis in range(3))
    return Turn(flips=(z, y, x))


def _turn_notes(parts: Parts) -> tuple[str, ...]:
    if parts.shear_deg:
        return (
            f"the registration shears the view by {parts.shear_deg:.3g} degrees: it is read as "
            "acquired, not sheared (deskew a stack that needs it before building)",
        )
    if parts.angle_deg:
        return (
            f"the registration turns the view by {parts.angle_deg:.3g} degrees: it is read as "
            "acquired, not turned",
        )
    if parts.turn.is_needed:
        axes = ", ".join(
            f"{'-' if flip else ''}{'zyx'[stored]}"
            for stored, flip in zip(parts.turn.order, parts.turn.flips, strict=True)
        )
        return (f"the registration is applied: z, y, x are the stored axes {axes}",)
    return ()


def _channel_notes(described: Described, setups: Sequence[int], time: int) -> tuple[str, ...]:
    """Return a note if the channels of a view are registered to different places."""
    found = [described.registrations.get((time, setup)) for setup in setups]
    first = found[0]
    if first is None or any(one is None or not np.isfinite(one).all() for one in found):
        return ()
    inverse = np.linalg.pinv(first)
    size = np.array([*(described.setups[setups[0]].size or (1, 1, 1))], float)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * size
    placed = np.c_[corners, np.ones(8)].T
    relative = [inverse @ matrix for matrix in found[1:] if matrix is not None]
    moved = [float(np.abs((one @ placed - placed)[:3]).max()) for one in relative]
    if max(moved, default=0.0) <= _SHIFT:
        return ()
    return (
        f"the registrations of the channels differ by up to {max(moved):.3g} voxels"
        f"{_differences(relative)}: the channels are read as they are stored, so they don't "
        "coincide",
    )


def _differences(relative: Sequence[Matrix]) -> str:
    """Return the scales and angles by which channels differ, for a note; empty: only by shifts."""
    parts = [one for one in map(decompose, relative) if one is not None]
    scale = max((abs(size - 1.0) for one in parts for size in one.scale), default=0.0)
    angle = max((max(one.angle_deg, one.shear_deg) for one in parts), default=0.0)
    found = [f"a scale of {scale:.2g}"] * (scale > _SKEW)
    found += [f"an angle of {angle:.2g} degrees"] * (angle > 0)
    return f", with {' and '.join(found)}" if found else ""

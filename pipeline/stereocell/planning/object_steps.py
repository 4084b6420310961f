"""Make the steps that build the objects of a plan's label maps."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.gltf import choose_step
from stereocell.model.tiling import Tile
from stereocell.objects.options import ObjectOptions
from stereocell.planning.located_objects import CUT, Located, tile_boxes
from stereocell.planning.plan import Plan
from stereocell.planning.plan_source import voxels_of
from stereocell.planning.survey import Survey
from stereocell.steps.build_objects import BuildObjects, Image, Painted
from stereocell.steps.labels import Labels

_NO_EDGES = (np.zeros(0, np.int64),) * 3  # edges of tiles for a step that cuts no object
_UM = 1e6  # um per metre


def object_steps(
    plan: Plan, located: Mapping[str, Located], survey: Survey
) -> dict[str, BuildObjects]:
    """Return the step of each unit of the label maps, by `<tile>/<labels>`."""
    images = images_of(plan)
    step_um = lattice_step_um(plan, located)
    steps = {}
    for labels in plan.labels:
        found, painted = located[labels.id], _painted(plan, labels, survey)
        boxes = tile_boxes(found.grid)
        for tile in plan.tiles:
            parts = _parts(found, tile)
            is_cut = len(parts["cut"]) or len(parts["others_cut"])
            steps[f"{tile.id}/{labels.id}"] = BuildObjects(
                labels,
                found.window(tile.id),
                boxes[tile.id],
                **parts,
                edges=found.grid.edges if is_cut else _NO_EDGES,
                step_um=step_um,
                images=images,
                painted=painted,
                options=_of_units(plan.settings.objects),
            )
    return steps


def _parts(found: Located, tile: Tile) -> dict[str, NDArray[np.uint64]]:
    """Return the labels in a tile's window as the fields of `BuildObjects` that hold them."""
    window, numbers = found.window(tile.id), found.owned(tile.id)
    near = np.zeros(0, np.int64) if window is None else found.near(window)
    is_cut, names = found.owners == CUT, found.extents.labels
    others = np.setdiff1d(near, numbers)
    return {
        "whole": names[numbers[~is_cut[numbers]]],
        "cut": names[numbers[is_cut[numbers]]],
        "others": names[others],
        "others_cut": names[others[is_cut[others]]],
    }


def _of_units(options: ObjectOptions) -> ObjectOptions:
    """Return the options that units depend on; all others are reset to their defaults."""
    plain = ObjectOptions()
    names = ("table", "table_key", "columns", "color_by", "segment_labels", "background")
    return replace(options, **{name: getattr(plain, name) for name in names})


def lattice_step_um(plan: Plan, located: Mapping[str, Located]) -> float:
    """Return the step of the lattice that objects' vertices lie on, um.

    It is a power of two in metres, chosen for the largest tile with its objects. The bundle's own
    lattice has this step or a fraction of it, so the checked vertices are the written ones.
    """
    longest = 0.0
    for tile in plan.tiles:
        spacing = np.asarray(plan.spacing_um)
        low = np.array(plan.position_um(tile.box.start)) - spacing
        high = np.array(plan.position_um(tile.box.stop)) + spacing
        for labels in plan.labels:
            window = located[labels.id].window(tile.id)
            if window is not None:
                low = np.minimum(low, labels.position_um(window.start))
                high = np.maximum(high, labels.position_um(window.stop))
        longest = max(longest, float((high - low).max()))
    return choose_step(longest) * _UM


def images_of(plan: Plan) -> tuple[Image, ...]:
    """Return the channels of the image, one for all surfaces of the same voxels."""
    seen, found = set(), []
    for channel in plan.channels:
        if channel.voxels_id in seen:
            continue
        seen.add(channel.voxels_id)
        found.append(Image(voxels_of(plan, channel), plan.region))
    return tuple(found)


def _painted(plan: Plan, labels: Labels, survey: Survey) -> Painted | None:
    """Return the channel that is painted on the objects of a label map; None: none is."""
    painter = plan.painter(labels)
    if painter is None:
        return None
    window = survey[painter.id].statistics.window
    image = Image(voxels_of(plan, painter), plan.region)
    return Painted(image, window, float(plan.settings.unwrap.paint_um))

"""Choose how a channel's surface is repaired: which gaps are closed and which fragments dropped.

The rule is that of the first paper, and uses a channel's connected components in all its tiles.
Fragments are dropped if they have less than half the mean number of triangles, or less than half
the mean diagonal. Alpha, the size of the gaps that are closed, then follows from the means D
(diagonal) and F (triangles) of the other components. D / sqrt(F) is the length of a triangle's side
times a factor of shape, which is larger for smooth bodies than for noisy ones.

ALPHA_SIDES times D / sqrt(F) is .6 um on nuclei in voxels of .28 x .14 x .14 um, .35 on membranes
and .3 on vessels. It is 10.5 on a real brain's cells in voxels of 5 x 2 x 2 um. The paper took 1
um. Alpha is kept between one coarsest spacing and `surface.max_alpha_um`. An offset of `auto` is
OFFSET_SHARE of alpha.

A unit sees only as much of a fragment as its halo holds. So the rule applies to fragments up to a
length that the plan allows for, and larger ones stay.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import cc3d
import numpy as np
from numpy.typing import NDArray

from stereocell.filters.boxes import dilate
from stereocell.isosurface.components import Components, find_components
from stereocell.isosurface.options import SurfaceOptions
from stereocell.isosurface.repair_options import RepairOptions
from stereocell.isosurface.thin_structures import count_thin
from stereocell.model.lattice import Step
from stereocell.model.settings import AUTO
from stereocell.model.spacing import Spacing

SHARE = 0.5  # share of a mean; a fragment below it is dropped
ALPHA_SIDES = 6.0  # alpha in units of D / sqrt(F)
MIN_ALPHA = 1.0  # least alpha in coarsest spacings, since nearer voxels have no gap between them
# Voxels. Additions by a lower level within this distance of a vessel only thicken its wall.
# Additions farther away are branches.
REACH = 2
MAIN_SHARE = 0.02  # least voxels of a main component, as a share of the largest component's
OFFSET_SHARE = 0.1  # offset as a share of alpha; the paper has 0.1 um for 1 um


@dataclass(frozen=True, slots=True)
class ComponentSums:
    """Sums over a tile's connected components. `kept_*` are sums over those that the rule keeps.

    count, faces, diagonal_um  of the components that are not specks
    voxels          of all components, specks included
    largest         of the largest component
    large_voxels    of the components that are not specks
    thin_voxels     part of large_voxels that is too thin if the surface is extracted from only
                    every k-th plane
    main_voxels     of the main components: at least MAIN_SHARE as large as the largest
    new_voxels      part of main_voxels in components that touch main components at a higher level,
                    but farther than REACH voxels from these; 0 without a higher level
    apart_voxels    part of main_voxels in components that touch no main component at that level
    """

    count: int
    faces: int
    diagonal_um: float
    kept: int
    kept_faces: int
    kept_diagonal_um: float
    voxels: int
    largest: int
    large_voxels: int
    thin_voxels: int
    main_voxels: int
    new_voxels: int = 0
    apart_voxels: int = 0


def sum_components(
    inside: NDArray[np.bool_],
    spacing_um: Spacing,
    min_diagonal_um: float,
    step: Step = (1, 1, 1),
    *,
    higher: NDArray[np.bool_] | None = None,
) -> ComponentSums:
    """Return the sums over the connected components of {field > iso-value}.

    inside           bool (z, y, x)
    spacing_um       (z, y, x)
    min_diagonal_um  components with a smaller diagonal (specks) are left out: noise has more of
                     them than a tile has bodies, and they would dominate the means
    step             voxels (z, y, x) between the planes from which the surface is extracted
    higher           bool (z, y, x), {field > a higher iso-value}: shows what `inside` adds to it
    """
    components = find_components(inside, spacing_um, 26)
    large = components.diagonal_um >= min_diagonal_um
    faces, diagonal = components.faces()[large], components.diagonal_um[large]
    voxels, largest = int(components.voxels.sum()), int(components.voxels.max(initial=0))
    main = int(components.voxels[_is_main(components)].sum())
    added = (0, 0) if higher is None else _added(components, higher, spacing_um)
    if not len(faces):
        return ComponentSums(0, 0, 0.0, 0, 0, 0.0, voxels, largest, 0, 0, main, *added)
    kept = (faces >= SHARE * faces.mean()) & (diagonal >= SHARE * diagonal.mean())
    return ComponentSums(
        len(faces),
        int(faces.sum()),
        float(diagonal.sum()),
        int(kept.sum()),
        int(faces[kept].sum()),
        float(diagonal[kept].sum()),
        voxels,
        largest,
        int(components.voxels[large].sum()),
        0 if step == (1, 1, 1) else count_thin(components.mask_of(large), step),
        main,
        *added,
    )


def _is_main(components: Components) -> NDArray[np.bool_]:
    return components.voxels >= MAIN_SHARE * components.voxels.max(initial=0)


def _added(
    components: Components, higher: NDArray[np.bool_], spacing_um: Spacing
) -> tuple[int, int]:
    """Return `new_voxels` and `apart_voxels` of `ComponentSums`."""
    above = find_components(higher, spacing_um, 26)
    before, main = above.mask_of(_is_main(above)), components.mask_of(_is_main(components))
    labels, count = cc3d.connected_components(main, connectivity=26, return_N=True)
    touches = np.zeros(count + 1, bool)
    touches[labels[before & main]] = True
    is_connected = touches[labels]
    around = dilate(before, (REACH, REACH, REACH))
    return int((is_connected & ~around).sum()), int((main & ~is_connected).sum())


def choose_repair(
    tiles: Iterable[Mapping[str, Any]],
    most: RepairOptions,
    *,
    surface: SurfaceOptions,
    spacing_um: Spacing,
) -> RepairOptions:
    """Return how a channel's surface is repaired.

    tiles       the ComponentSums of each tile, as dictionaries
    most        upper bounds; the units' halo covers them
    surface     settings; `auto` values follow from the tiles
    spacing_um  (z, y, x)
    """
    sums = list(tiles)
    count, kept = (sum(tile[key] for tile in sums) for key in ("count", "kept"))
    options = most
    if count and most.max_fragment_um > 0:
        diagonal = SHARE * sum(tile["diagonal_um"] for tile in sums) / count
        options = replace(
            most,
            min_diagonal_um=max(most.min_diagonal_um, min(diagonal, most.max_fragment_um)),
            min_faces=SHARE * sum(tile["faces"] for tile in sums) / count,
        )
    if surface.alpha_um == AUTO:
        alpha = most.alpha_um
        faces = sum(tile["kept_faces"] for tile in sums)
        if faces:  # tiles that are filled by a solid have none
            diagonal = sum(tile["kept_diagonal_um"] for tile in sums) / kept
            faces /= kept
            alpha = ALPHA_SIDES * diagonal / faces**0.5
        least = MIN_ALPHA * max(spacing_um)
        options = replace(options, alpha_um=min(max(alpha, least), most.alpha_um))
    wraps_triangles = surface.wrap == "alpha-wrap"  # this wrap cannot have an offset of 0
    if surface.offset_um == AUTO or (wraps_triangles and not options.offset_um):
        options = replace(options, offset_um=OFFSET_SHARE * options.alpha_um)
    return options

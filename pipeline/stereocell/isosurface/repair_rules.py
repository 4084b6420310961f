"""Choose how a channel's surface is repaired: the gaps that are bridged, the fragments that go.

The rule of the first paper uses a channel's connected components in all its tiles. Fragments go
that have less than half the mean number of triangles, or half the mean diagonal. Then alpha, the
size of the gaps that are bridged, follows from the means D (diagonal) and F (triangles) of the
others. D / sqrt(F) is the length of a triangle's side times a factor of shape, larger for plain
bodies than for frayed ones. ALPHA_SIDES times it is .6 um on nuclei in voxels of .28 x .14 x .14
um, .35 on membranes, .3 on vessels, 10.5 on a real brain's cells in voxels of 5 x 2 x 2 um (the
paper took 1 um). It stays between a coarsest spacing and `surface.max_alpha_um`. An offset of
`auto` is OFFSET_SHARE of alpha.

A unit sees no more of a fragment than its halo holds: the rule applies to fragments up to a length
that the plan allows for, and larger ones stay.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import cc3d
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.isosurface.components import Components, find_components
from stereocell.isosurface.options import SurfaceOptions
from stereocell.isosurface.repair import RepairOptions
from stereocell.isosurface.thin_structures import count_thin
from stereocell.model.lattice import Step
from stereocell.model.settings import AUTO
from stereocell.model.spacing import Spacing

SHARE = 0.5  # share of a mean below which a fragment goes
ALPHA_SIDES = 6.0  # alpha in units of D / sqrt(F)
MIN_ALPHA = 1.0  # least alpha in coarsest spacings: nearer voxels have no gap between them
REACH = 2  # voxels: a branch reaches farther from the vessels at a higher level, a thicker wall not
MAIN_SHARE = 0.02  # of the largest component's voxels: components with fewer are not the main ones
OFFSET_SHARE = 0.1  # offset as a share of alpha, as the paper's 0.1 um of 1 um


@dataclass(frozen=True, slots=True)
class ComponentSums:
    """Sums over a tile's connected components: over all of them, and over those the rule keeps.

    voxels, largest          of all components, specks included; of the largest
    large_voxels             of all components but specks
    thin_voxels              those of them that are too thin for the planes that carry the surface
    main_voxels              of the main components: at least MAIN_SHARE as large as the largest
    new_voxels, apart_voxels of them, beside the main components at a higher level, where one is
                             given: farther than REACH voxels from these; in components that touch
                             none of these
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
    min_diagonal_um  smaller components are left out: noise has more of them than a tile has bodies,
                     so they would decide the means
    step             voxels (z, y, x) between planes that carry the surface
    higher           bool (z, y, x): {field > a higher iso-value}, to tell what `inside` adds to it
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
    """Return `new_voxels` and `apart_voxels` of ComponentSums."""
    above = find_components(higher, spacing_um, 26)
    before, main = above.mask_of(_is_main(above)), components.mask_of(_is_main(components))
    labels, count = cc3d.connected_components(main, connectivity=26, return_N=True)
    touches = np.zeros(count + 1, bool)
    touches[labels[before & main]] = True
    hangs = touches[labels]
    around = ndimage.binary_dilation(before, np.ones((3, 3, 3), bool), REACH)
    return int((hangs & ~around).sum()), int((main & ~hangs).sum())


def choose_repair(
    tiles: Iterable[Mapping[str, Any]],
    most: RepairOptions,
    *,
    surface: SurfaceOptions,
    spacing_um: Spacing,
) -> RepairOptions:
    """Return how a channel's surface is repaired.

    tiles       the ComponentSums of each tile, as dictionaries
    most        the upper bounds: the units' halo covers them
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
        if faces:  # solids that fill their tiles have none
            diagonal = sum(tile["kept_diagonal_um"] for tile in sums) / kept
            faces /= kept
            alpha = ALPHA_SIDES * diagonal / faces**0.5
        least = MIN_ALPHA * max(spacing_um)
        options = replace(options, alpha_um=min(max(alpha, least), most.alpha_um))
    wraps_triangles = surface.wrap == "alpha-wrap"  # that wrap knows no offset of 0
    if surface.offset_um == AUTO or (wraps_triangles and not options.offset_um):
        options = replace(options, offset_um=OFFSET_SHARE * options.alpha_um)
    return options

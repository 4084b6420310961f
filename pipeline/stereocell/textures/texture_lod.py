"""Textures of a level of detail: maps where it has UVs, values at its vertices elsewhere."""

from dataclasses import replace

import numpy as np

from stereocell.model.mesh import Baked, Lod
from stereocell.model.timing import Clock
from stereocell.textures.bake import Baker, bake
from stereocell.textures.options import UnwrapOptions
from stereocell.textures.unwrap import unwrap


def texture_lod(lod: Lod, level: int, *, baker: Baker, options: UnwrapOptions, clock: Clock) -> Lod:
    """Return the level with maps, or with values at its vertices.

    level    number of the level, 0: the finest
    options  resolved
    """
    reason = f"finer than lod{options.first_lod}" if level < options.first_lod else ""
    if not reason:
        with clock("unwrap"):
            unwrapped = unwrap(lod.mesh, options)
        if not isinstance(unwrapped, str):
            with clock("bake"):
                maps = bake(unwrapped.mesh, unwrapped.size, baker)
            baked = Baked(maps.openness, maps.paint, unwrapped.texel_um, unwrapped.charts)
            return replace(lod, mesh=unwrapped.mesh, normal_map=maps.normals, baked=baked)
        reason = unwrapped
    with clock("bake"):
        mesh = lod.mesh
        found = baker.look_up(mesh.positions.astype(np.float64), mesh.normals.astype(np.float64))
        openness = np.round(found.openness * 255).astype(np.uint8)
        paint = None if found.paint is None else np.round(found.paint * 255).astype(np.uint8)
    return replace(lod, baked=Baked(openness, paint, reason=reason))

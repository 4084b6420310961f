"""Values of a level of detail: at its vertices, or in maps if these are requested."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stereocell.model.mesh import Baked, Lod
from stereocell.model.timing import Clock
from stereocell.textures.bake import Baker, FineSurface, bake
from stereocell.textures.options import UnwrapOptions
from stereocell.textures.unwrap import unwrap


@dataclass(frozen=True, slots=True)
class VertexValues:
    """Values at the vertices of the finest level that is made.

    openness  float32 (n,) 0..1: 1 - ambient occlusion, see textures/ambient_occlusion.py
    paint     float32 (n,) 0..1: intensity of the sampled channel; None: no channel is sampled
    """

    openness: NDArray[np.float32]
    paint: NDArray[np.float32] | None = None

    def at(self, vertices: NDArray[np.int64]) -> Baked:
        """Return the values at the vertices with these indices, in 8 bits."""
        openness = np.round(self.openness[vertices] * 255).astype(np.uint8)
        if self.paint is None:
            return Baked(openness)
        return Baked(openness, np.round(self.paint[vertices] * 255).astype(np.uint8))


class Texturer:
    """Gives levels of detail their ambient occlusion and sampled channel, at vertices or as maps.

    The vertices of a coarser level are a part of the finest level's vertices.

    options     options whose `auto` lengths are replaced, see `UnwrapOptions.resolved`
    values      values at the vertices of the finest level
    get_source  returns the surface from which maps are baked; called only if maps are requested
    """

    def __init__(
        self,
        options: UnwrapOptions,
        values: VertexValues,
        get_source: Callable[[], FineSurface],
        clock: Clock,
    ) -> None:
        self._options, self._values, self._clock = options, values, clock
        self._get_source = get_source
        self._baker: Baker | None = None

    def texture(self, lod: Lod, level: int, vertices: NDArray[np.int64]) -> Lod:
        """Return a level of detail with maps, or with values at its vertices.

        level     number of the level, 0: the finest
        vertices  int64 (n,), index of each vertex in the finest level
        """
        reason = self._why_no_maps(level)
        if not reason:
            with self._clock("unwrap"):
                unwrapped = unwrap(lod.mesh, self._options)
            if not isinstance(unwrapped, str):
                with self._clock("bake"):
                    self._baker = self._baker or Baker(self._get_source())
                    maps = bake(unwrapped.mesh, unwrapped.size, self._baker)
                baked = Baked(maps.openness, maps.paint, unwrapped.texel_um, unwrapped.charts)
                return replace(lod, mesh=unwrapped.mesh, normal_map=maps.normals, baked=baked)
            reason = unwrapped
        return replace(lod, baked=replace(self._values.at(vertices), reason=reason))

    def _why_no_maps(self, level: int) -> str:
        """Return the reason why a level gets no maps regardless of its mesh; empty if it may."""
        if not self._options.maps:
            return "maps were not requested"
        first = self._options.first_lod
        return f"finer than lod{first}" if level < first else ""

"""Settings of UVs and baked maps."""

from dataclasses import dataclass, replace

from stereocell.model.errors import UsageError
from stereocell.model.settings import (
    AUTO,
    COUNT,
    COUNT_OR_NONE,
    LENGTH_UM,
    Bounds,
    Flag,
    length_um,
    require_bounds,
    setting,
)
from stereocell.model.spacing import Spacing

# Allowed values of the largest edge of a map, in texels
TEXTURES = tuple(2**k for k in range(6, 14))
# Texels between charts. With 24 texels, charts do not mix in mip levels 0 to 3, and xatlas packs
# 2,500 charts in 7 s; with 64 texels it takes 90 s.
MAX_PADDING = 24
# Largest number of texels along the finest voxel spacing. Texels finer than voxels show nothing
# new. At a tenth xatlas is slow, and far below that it crashes.
MAX_TEXELS = 10
# Coarsest voxel spacings; largest reach of rays into the body and past its ends, because the voxels
# that they cross are held in memory
MAX_REACH = 64.0


@dataclass(frozen=True, slots=True)
class UnwrapOptions:
    """UVs and baked maps, for DCC tools. Levels without maps have their values at the vertices.

    Raises UsageError for a number out of range.
    """

    maps: bool = setting(
        False,
        "whether coarser levels get UVs and baked maps; they are then 4 to 6 times as large",
        flag=Flag(
            "--maps",
            "bake maps of normals, occlusion and paint with UVs for coarser levels, for DCC tools; "
            "needs the extra `maps` (default: only normals and values at vertices)",
        ),
    )
    first_lod: int = setting(1, "finest level that gets UVs and baked maps", bounds=COUNT_OR_NONE)
    texel_um: float | str = setting(
        AUTO, "edge of a texel in um; auto: the coarsest voxel spacing", bounds=LENGTH_UM
    )
    padding: int = setting(
        6,
        "texels between charts; 6 keep mip levels 0 and 1 apart, 12 also 2",
        bounds=Bounds(3, MAX_PADDING),
    )
    # With texels of one coarse voxel spacing, a unit of 194 x 512 x 512 voxels full of membranes
    # needs a map of 1750 texels. Units of nuclei and vessels need 300 to 1000.
    max_texture: int = setting(
        1024, "largest edge of a map in texels; texels grow up to 2.8 times to fit", bounds=COUNT
    )
    max_triangles: int = setting(
        100_000, "levels with more triangles get no maps", bounds=COUNT_OR_NONE
    )
    occlusion_um: float | str = setting(
        AUTO,
        "reach of ambient occlusion; auto: 8 coarsest spacings; 0: no ambient occlusion",
        bounds=LENGTH_UM,
    )
    paint_um: float | str = setting(
        AUTO,
        "depth below the surface in which paint takes its maximum; auto: 2 coarsest spacings",
        bounds=LENGTH_UM,
    )

    def __post_init__(self) -> None:
        require_bounds("unwrap", self)
        if self.max_texture not in TEXTURES:
            raise UsageError(
                f"unwrap.max_texture is {self.max_texture}, expected a power of two "
                f"from {TEXTURES[0]} to {TEXTURES[-1]}"
            )

    def resolved(self, spacing_um: Spacing) -> "UnwrapOptions":
        """Return the options with every `auto` replaced by a length.

        Raises UsageError for a length that does not fit the voxels.
        """
        finest, coarsest = min(spacing_um), max(spacing_um)
        texel_um = length_um("unwrap.texel_um", self.texel_um, coarsest)
        if MAX_TEXELS * texel_um < finest * (1 - 1e-9):
            raise UsageError(
                f"unwrap.texel_um is {texel_um:g}, expected at least {finest / MAX_TEXELS:g} "
                f"(the finest voxel spacing / {MAX_TEXELS})"
            )
        occlusion_um = length_um("unwrap.occlusion_um", self.occlusion_um, 8 * coarsest)
        paint_um = length_um("unwrap.paint_um", self.paint_um, 2 * coarsest)
        for key, length in (("occlusion_um", occlusion_um), ("paint_um", paint_um)):
            if length > MAX_REACH * coarsest * (1 + 1e-9):
                raise UsageError(
                    f"unwrap.{key} is {length:g}, expected at most {MAX_REACH * coarsest:g} "
                    f"({MAX_REACH:g} times the coarsest voxel spacing)"
                )
        return replace(self, texel_um=texel_um, occlusion_um=occlusion_um, paint_um=paint_um)

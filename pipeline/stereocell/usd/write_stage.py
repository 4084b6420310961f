"""Write the stage of a specimen: stage.usda, and the layers that it refers to.

stage.usda                    /Specimen, with a reference to contents.usda
contents.usda                 tiles as payloads, and cameras; both looks/ layers are its sublayers
looks/channels.usda           /Specimen/Channels, see usd/write_appearances.py
looks/lights.usda             a copy of usd_assets/lights.usda, with the image of its dome
tiles/<tile>/tile.usdc        see usd/write_tile.py

specimen.usdz                 see usd/write_usdz.py
display.usda                  the stage, enlarged: see usd/write_display.py
nvindex.usda                  the stage for NVIDIA IndeX: see usd/write_nvindex.py

In USD, a layer's own opinions are stronger than inherits, inherits are stronger than variants, and
variants are stronger than references. All content of a build comes by a reference. So any opinion
in a layer over the stage is stronger, even in a class that a channel inherits, or in a variant of
/Specimen or of a prim above. The prim /Specimen inherits the empty class /__class__/Specimen. If a
scene edits this class, it edits every specimen that the scene references.

contents.usda repeats the variants that each tile selects, so that they are known before the tile is
loaded.
"""

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Kind, Sdf, Usd, UsdGeom

from stereocell.model.channel import Appearance
from stereocell.model.object_table import ObjectTable
from stereocell.model.physical_size import describe_size, display_scale
from stereocell.model.rigid_transform import IDENTITY, Matrix
from stereocell.model.spacing import Point, Spacing
from stereocell.model.tile_content import Provenance, TileContent
from stereocell.model.world_box import box_around, move_box, world_box
from stereocell.storage.assets import find_asset
from stereocell.storage.atomic_write import replacing_folder
from stereocell.storage.workspace import cached
from stereocell.usd.cameras import define_cameras
from stereocell.usd.layer import (
    BROADCAST,
    DISPLAY_SCALE,
    OPENING_CUT,
    PATIENT_API,
    ROOT,
    SIDES,
    SPECIMEN_API,
    TILES,
    export,
    is_layer,
    new_stage,
    set_attribute,
    vec3f,
)
from stereocell.usd.opening import PATIENT_SIDES, opening_plane
from stereocell.usd.write_appearances import write_appearances
from stereocell.usd.write_display import write_display
from stereocell.usd.write_nvindex import write_nvindex
from stereocell.usd.write_tile import LAYER_NAME, write_tile
from stereocell.usd.written_files import CONTENTS_NAME, DISPLAY_NAME, STAGE_NAME

__all__ = ["SUBLAYERS", "TileExtent", "is_layer", "write_stage", "write_tile"]

# Sublayers of contents.usda, strongest first
SUBLAYERS = ("./looks/channels.usda", "./looks/lights.usda")
_NOTE = """Put edits into a layer of your own that has this layer as a sublayer, because a new build
overwrites these files. All content comes from contents.usda by a reference. So any opinion in your
layers is stronger, also in classes and variants."""
_CONTENTS_NOTE = """Tiles and cameras. Colours and transfer functions are in looks/, the data in
tiles/. Put edits into a layer over stage.usda. `stereocell bundle` does not know layers over this
one."""


@dataclass(frozen=True, slots=True)
class TileExtent:
    """The place of a tile; see TileContent. Lengths are (z, y, x) in um."""

    id: str
    first_um: Point
    last_um: Point
    spacing_um: Spacing

    @classmethod
    def of(cls, tile: TileContent) -> "TileExtent":
        """Return the extent of a tile's content, without its voxels and meshes."""
        return cls(tile.id, tile.first_um, tile.last_um, tile.spacing_um)

    @property
    def drawn_box(self) -> NDArray[np.float64]:
        """Corners (2, 3), (x, y, z) in um, half a voxel outside the outermost voxels' centres."""
        half = np.asarray(self.spacing_um) / 2
        return np.array(world_box(self.first_um - half, self.last_um + half))


def write_stage(
    stage_dir: Path,
    name: str,
    *,
    appearances: Sequence[Appearance],
    tiles: Sequence[TileExtent],
    provenance: Provenance,
    modality: str = "",
    placement: Matrix = IDENTITY,
    has_sides: bool = False,
    opens_cut: bool = False,
    tables: Mapping[str, ObjectTable] | None = None,
) -> str:
    """Write the stage over tiles that `write_tile` has written.

    Returns a sentence about the specimen's physical size.

    A tile that is written later shows its default variants; contents.usda does not select any.

    name        name of the specimen, which becomes the display name of /Specimen
    provenance  settings and versions, for the customLayerData of stage.usda; numbers, texts and
                dictionaries are stored as they are, other values as JSON
    modality    DICOM's code of the modality (`MR`, `CT`, ...); empty: not known
    placement   rows of a (4, 4) matrix for column vectors, um: the transform of /Specimen/Tiles;
                the identity is not written
    has_sides   whether the placed specimen is aligned with the patient as in
                read/anatomical_axes.py; then the tiles' group states the patient's sides
    opens_cut   whether the specimen opens with a clip plane through its middle, perpendicular to x;
                in a patient, the plane separates left and right
    tables      object tables of label maps, by channel ID

    Raises OutputError if a file can't be written.
    """
    with replacing_folder(stage_dir / "looks") as folder:
        write_appearances(folder, appearances, tables or {})
        for asset in (find_asset("usd_assets/lights.usda"), find_asset("usd_assets/studio.exr")):
            shutil.copyfile(asset, folder / asset.name)

    stage = new_stage(".usda", ROOT.name)
    root = UsdGeom.Xform.Define(stage, ROOT).GetPrim()
    root.SetDisplayName(name)
    root.AddAppliedSchema(SPECIMEN_API)
    UsdGeom.ModelAPI.Apply(root)
    set_attribute(root, "stereocell:modality", Sdf.ValueTypeNames.Token, modality)
    Usd.ModelAPI(root).SetKind(Kind.Tokens.assembly)
    group = UsdGeom.Xform.Define(stage, TILES)
    Usd.ModelAPI(group.GetPrim()).SetKind(Kind.Tokens.group)
    move = np.array(placement).T  # USD uses row vectors
    if placement != IDENTITY:
        group.AddTransformOp().Set(Gf.Matrix4d(*move.ravel().tolist()))
    if has_sides:
        _state_sides(group.GetPrim(), move)
    boxes = np.zeros((len(tiles), 2, 3))
    surfaces: dict[str, list[NDArray[np.float64]]] = {}  # boxes (2, 3), um, of surfaces
    for box, tile in zip(boxes, tiles, strict=True):
        prim = UsdGeom.Xform.Define(stage, TILES.AppendChild(tile.id)).GetPrim()
        Usd.ModelAPI(prim).SetKind(Kind.Tokens.component)
        prim.GetPayloads().AddPayload(f"./tiles/{tile.id}/{LAYER_NAME}")
        file = stage_dir / "tiles" / tile.id / LAYER_NAME
        with cached(file):
            selections, extents = _read_layer(file, surfaces)
        for variant_set, variant in selections:
            prim.GetVariantSets().GetVariantSet(variant_set).SetVariantSelection(variant)
        # The hint tells programs the box of an unloaded tile. It also contains surfaces that an
        # offset moved out of the tile's own box.
        box[:] = box_around(np.array([tile.drawn_box, *extents]))
        UsdGeom.ModelAPI.Apply(prim).SetExtentsHint(vec3f(box))
    moved = np.array([move_box(low, high, move) for low, high in boxes])
    if opens_cut:
        _state_cut(root, moved)
    whole = box_around(moved)
    shown = _box_shown(appearances, surfaces, move, whole)
    define_cameras(stage, whole, shown)
    UsdGeom.ModelAPI(root).SetExtentsHint(vec3f(whole))
    size = describe_size(whole[1] - whole[0])
    root.SetDocumentation(
        f"{name}: {size} in true size; a unit is 1 um. Channels holds the appearance of each "
        "channel, Shown their visibility, and Tiles the surfaces and volumes."
    )
    scale = display_scale(float((whole[1] - whole[0]).max()))
    set_attribute(root, DISPLAY_SCALE, Sdf.ValueTypeNames.Double, scale)
    with_volumes = [one for one in appearances if one.id not in (tables or {})]
    write_nvindex(stage_dir, with_volumes, [tile.id for tile in tiles])

    layer = stage.GetRootLayer()
    layer.documentation = _CONTENTS_NOTE
    del stage  # the sublayers would not resolve for a layer in memory
    layer.subLayerPaths = list(SUBLAYERS)
    export(layer, stage_dir / CONTENTS_NAME)
    version = _write_interface(stage_dir, name, provenance)
    write_display(stage_dir, name, version, whole, shown, scale)
    return (
        f"the size of the specimen is {size}; {DISPLAY_NAME} shows it {scale:.0f} times as large, "
        "in metres"
    )


def _write_interface(stage_dir: Path, name: str, provenance: Provenance) -> str:
    """Write stage.usda: the specimen's root prim with a reference to all content.

    Returns the version of the asset.
    """
    plain = {key: _plain(value) for key, value in provenance.items()}
    stage = new_stage(".usda", ROOT.name)
    root = UsdGeom.Xform.Define(stage, ROOT).GetPrim()
    for path, kind in ((BROADCAST.GetParentPath(), "Scope"), (BROADCAST, "Xform")):
        stage.DefinePrim(path, kind).SetSpecifier(Sdf.SpecifierClass)
    root.GetInherits().AddInherit(BROADCAST)
    model = Usd.ModelAPI(root)
    model.SetAssetName(name)
    model.SetAssetIdentifier(Sdf.AssetPath(f"./{STAGE_NAME}"))
    # The version is a hash of everything that the build depends on.
    text = json.dumps(plain, sort_keys=True)
    version = hashlib.sha256(text.encode()).hexdigest()[:12]
    model.SetAssetVersion(version)
    layer = stage.GetRootLayer()
    layer.documentation = _NOTE
    layer.customLayerData = {"stereocell": plain}
    del stage  # the reference would not resolve for a layer in memory
    reference = layer.GetPrimAtPath(ROOT).referenceList
    reference.prependedItems.append(Sdf.Reference(f"./{CONTENTS_NAME}"))
    export(layer, stage_dir / STAGE_NAME)
    return version


def _state_cut(root: Usd.Prim, boxes: NDArray[np.float64]) -> None:
    """Write the clip plane at opening: it cuts away the half of the specimen with larger x.

    boxes  (tiles, 2, 3), lower and upper corners (x, y, z), um, world
    """
    normal, offset = opening_plane(boxes)
    set_attribute(root, OPENING_CUT, Sdf.ValueTypeNames.Double4, Gf.Vec4d(*normal, offset))


def _state_sides(group: Usd.Prim, move: NDArray[np.float64]) -> None:
    """Write the directions to the patient's sides in the group's own axes, so they turn with it.

    move  (4, 4) for row vectors, from the group's axes to the patient's world: x is left, y is
          superior, z is anterior
    """
    group.AddAppliedSchema(PATIENT_API)
    for side, name in SIDES.items():
        own = np.array(PATIENT_SIDES[side]) @ np.linalg.inv(move[:3, :3])
        set_attribute(group, name, Sdf.ValueTypeNames.Vector3d, Gf.Vec3d(*own.tolist()))


def _box_shown(
    appearances: Sequence[Appearance],
    surfaces: Mapping[str, list[NDArray[np.float64]]],
    move: NDArray[np.float64],
    whole: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the box (2, 3), world um, around the surfaces of the channels that show at opening.

    It is the whole box if one of these channels has no surface, since a volume may fill it.
    """
    opening = [one.id for one in appearances if one.opens]
    if not opening or any(id_ not in surfaces for id_ in opening):
        return whole
    boxes = [move_box(low, high, move) for id_ in opening for low, high in surfaces[id_]]
    return box_around(np.array(boxes))


def _read_layer(
    file: Path, surfaces: dict[str, list[NDArray[np.float64]]]
) -> tuple[list[tuple[str, str]], list[NDArray[np.float64]]]:
    """Return the selections (variant set, variant) of a tile's layer, and the extents of its prims.

    Extents are (2, 3), um, and those of all variants are included. The extents of meshes are also
    added to `surfaces`, by channel.
    """
    if not file.is_file():
        return [], []
    layer = Sdf.Layer.OpenAsAnonymous(str(file))
    extents: list[NDArray[np.float64]] = []

    def collect(path: Sdf.Path) -> None:
        if path.name != "extent":
            return
        extents.append(np.array(layer.GetAttributeAtPath(path).default, np.float64))
        # The type of a prim is stated outside of its variants.
        place = path.GetPrimPath().StripAllVariantSelections()
        if layer.GetPrimAtPath(place).typeName == "Mesh":
            surfaces.setdefault(place.GetParentPath().name, []).append(extents[-1])

    layer.Traverse(Sdf.Path.absoluteRootPath, collect)
    selected = layer.GetPrimAtPath(f"/{layer.defaultPrim}").variantSelections
    chosen = sorted((str(name), str(variant)) for name, variant in selected.items())
    return chosen, extents


def _plain(value: object) -> object:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, bool | int | float | str):
        return value
    return json.dumps(value, sort_keys=True)

"""Select tiles and variants of a stage in a layer over it; Blender's importer cannot."""

from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from pxr import Sdf, Tf, Usd

from .problem import StageProblem

AS_STAGED = "AS_STAGED"
ROOT = "/Specimen"
TILES = f"{ROOT}/Tiles"
CHANNELS = f"{ROOT}/Channels"
SHOWN = f"{ROOT}/Shown"  # parent of a prim for each channel, with its visibility in all tiles
ALL = "ALL"
METERS_PER_UNIT = 1e-6
DISPLAY_SCALE = "stereocell:displayScale"  # attribute of /Specimen: enlargement at display size


@dataclass(frozen=True)
class Choice:
    """The parts of a stage to import. AS_STAGED keeps the variant that the stage selects.

    tiles  names or patterns with * and ?, separated by commas
    """

    tiles: str = "*"
    lod: str = AS_STAGED
    representation: str = AS_STAGED
    transfer_function: str = AS_STAGED
    channels: str = AS_STAGED  # ALL imports also the channels that the stage hides


def open_stage(path):
    """Open a StereoCell stage without its payloads.

    Raises StageProblem if the file is not a StereoCell stage, or has another unit or up axis.
    """
    try:
        stage = Usd.Stage.Open(str(path), Usd.Stage.LoadNone)
    except Tf.ErrorException as error:
        raise StageProblem(f"{path}: can't be opened as a USD stage") from error
    lacking = [place for place in (TILES, CHANNELS) if not stage.GetPrimAtPath(place)]
    if lacking:
        raise StageProblem(f"{path}: no prim {lacking[0]}, expected a StereoCell stage")
    unit = stage.GetMetadata("metersPerUnit")
    if abs(unit / METERS_PER_UNIT - 1) > 1e-6:
        raise StageProblem(
            f"{path}: metersPerUnit is {unit:g}, expected {METERS_PER_UNIT:g}: write it into the "
            "parentheses at the top of the layer"
        )
    axis = stage.GetMetadata("upAxis")
    if axis != "Y":
        raise StageProblem(
            f'{path}: upAxis is {axis}, expected Y: write upAxis = "Y" into the parentheses at the '
            "top of the layer"
        )
    return stage


def shared_functions(stage):
    """Return the names of the transfer functions that all channels of a stage have."""
    channels = stage.GetPrimAtPath(CHANNELS).GetChildren()
    names = [_functions_of(channel) for channel in channels]
    return [one for one in names[0] if all(one in others for others in names)] if names else []


def write_choice(stage, choice, file):
    """Write a layer over a stage that selects the chosen tiles, variants and channels.

    Return the stage's own variant selections of the chosen tiles, by tile and variant set.

    Raises StageProblem if no tile matches, or if a channel lacks the transfer function.
    """
    # A tile that the stage deactivates can't be loaded, and stays deactivated.
    tiles = stage.GetPrimAtPath(TILES).GetFilteredChildren(Usd.PrimIsActive & Usd.PrimIsDefined)
    chosen = [tile for tile in tiles if _fits(tile.GetName(), choice.tiles)]
    if not chosen:
        raise StageProblem(f"no tile fits {choice.tiles!r}; there are {_some_names(tiles)}")
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.subLayerPaths = [Path(stage.GetRootLayer().realPath).as_posix()]
    layer.defaultPrim = ROOT.strip("/")
    layer.pseudoRoot.SetInfo("metersPerUnit", METERS_PER_UNIT)
    layer.pseudoRoot.SetInfo("upAxis", "Y")
    staged = {}
    for tile in tiles:
        over = Sdf.CreatePrimInLayer(layer, tile.GetPath())
        if tile not in chosen:
            over.active = False
            continue
        tile.Load()
        staged[tile.GetName()] = dict(tile.GetVariantSets().GetAllVariantSelections())
        for name in ("lod", "representation"):
            variant = _variant(tile, name, getattr(choice, name))
            if variant is not None:
                over.variantSelections[name] = variant
        tile.Unload()
    if choice.channels == ALL and stage.GetPrimAtPath(SHOWN):
        for shown in stage.GetPrimAtPath(SHOWN).GetChildren():
            over = Sdf.CreatePrimInLayer(layer, shown.GetPath())
            visibility = Sdf.AttributeSpec(over, "visibility", Sdf.ValueTypeNames.Token)
            visibility.default = "inherited"
    if choice.transfer_function != AS_STAGED:
        for channel in stage.GetPrimAtPath(CHANNELS).GetChildren():
            known = _functions_of(channel)
            if choice.transfer_function not in known:
                raise StageProblem(
                    f"{channel.GetName()} has no transfer function {choice.transfer_function!r}, "
                    f"but {', '.join(known)}"
                )
            over = Sdf.CreatePrimInLayer(layer, channel.GetPath())
            over.variantSelections["transferFunction"] = choice.transfer_function
    if not layer.Export(str(file)):
        raise StageProblem(f"{file}: can't be written")
    return staged


def _functions_of(channel):
    return channel.GetVariantSet("transferFunction").GetVariantNames()


def _fits(name, patterns):
    return any(fnmatchcase(name, pattern.strip()) for pattern in patterns.split(","))


def _some_names(tiles):
    names = [tile.GetName() for tile in tiles]
    return ", ".join(names[:6]) + (" ..." if len(names) > 6 else "")


def _variant(tile, variant_set, wanted):
    """Return the variant to select, or None to keep the stage's selection.

    If the tile does not have the wanted level of detail, its coarsest one is returned.
    """
    known = sorted(tile.GetVariantSet(variant_set).GetVariantNames())
    if wanted == AS_STAGED or not known:
        return None
    return wanted if wanted in known else known[-1]

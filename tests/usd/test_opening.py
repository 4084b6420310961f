"""A stage states how a specimen opens: its cut and its visible channels."""

from pathlib import Path

import pytest
from pxr import Gf, Usd, UsdGeom

from stereocell.model.channel import Appearance
from stereocell.model.errors import StageError
from stereocell.usd.drawn_prims import is_visible
from stereocell.usd.layer import CHANNELS, OPENING_CUT, ROOT, SHOWN
from stereocell.usd.read_appearances import read_appearances, shows_at_first
from stereocell.usd.read_stage import open_stage, opening_cut_of, tile_prims
from stereocell.usd.write_stage import TileExtent, write_stage
from support.stages import F_ID, write_whole

FUNCTIONS = dict.fromkeys(("default", "bone"), ((0.0, 0.0), (1.0, 0.5)))


def _written(folder: Path, *, opens_cut: bool) -> Usd.Stage:
    looks = [
        Appearance("Skin", (1, 1, 1), (0, 1), None, 0.0, "none", FUNCTIONS, opens=False),
        Appearance("Bone", (1, 1, 1), (0, 1), None, 0.0, "none", FUNCTIONS, function="bone"),
    ]
    # corner voxels' centres (z, y, x), um; the box that is drawn reaches half a voxel farther
    tile = TileExtent("r0_c0", (0.0, 0.0, 100.0), (30.0, 20.0, 120.0), (2.0, 2.0, 2.0))
    write_stage(folder, "Head", appearances=looks, tiles=[tile], provenance={}, opens_cut=opens_cut)
    return open_stage(folder / "stage.usda")


def test_specimen_opens_whole_or_cut_through_its_middle(tmp_path: Path) -> None:
    assert opening_cut_of(_written(tmp_path / "whole", opens_cut=False)) is None
    assert opening_cut_of(_written(tmp_path / "cut", opens_cut=True)) == ((1, 0, 0), 110)


def test_an_edited_cut_is_taken_over_and_one_without_direction_is_refused(tmp_path: Path) -> None:
    stage = _written(tmp_path, opens_cut=True)
    attribute = stage.GetPrimAtPath(ROOT).GetAttribute(OPENING_CUT)
    attribute.Set(Gf.Vec4d(0, 0, -2, 6))
    assert opening_cut_of(stage) == ((0, 0, -1), 3)
    attribute.Set(Gf.Vec4d(0, 0, 0, 6))
    with pytest.raises(StageError, match=r"openingCut: .*expected the normal"):
        opening_cut_of(stage)


def test_channels_open_visible_or_hidden_with_their_own_function(tmp_path: Path) -> None:
    skin, bone = read_appearances(_written(tmp_path, opens_cut=False))
    assert (skin.opens, skin.chosen) == (False, "default")
    assert (bone.opens, bone.chosen) == (True, "bone")


def test_one_edit_hides_a_channel_in_all_tiles_and_the_bundle_still_has_it(tmp_path: Path) -> None:
    stage = Usd.Stage.Open(str(write_whole(tmp_path)))
    branches = [prim.GetChild(F_ID) for prim in tile_prims(stage)]
    assert len(branches) > 1
    shown = UsdGeom.Imageable(stage.GetPrimAtPath(SHOWN.AppendChild(F_ID)))
    material = stage.GetPrimAtPath(CHANNELS.AppendChild(F_ID))
    assert all(_seen(branch) for branch in branches)
    shown.MakeInvisible()
    assert not any(_seen(branch) for branch in branches)  # other programs draw none of them
    assert all(is_visible(branch) for branch in branches)  # a bundle has all of them
    assert not shows_at_first(material)
    UsdGeom.Imageable(branches[0]).GetVisibilityAttr().Set("invisible")
    assert [is_visible(branch) for branch in branches] == [False] + [True] * (len(branches) - 1)
    shown.GetVisibilityAttr().Set("inherited")
    assert [_seen(branch) for branch in branches] == [False] + [True] * (len(branches) - 1)


def _seen(prim: Usd.Prim) -> bool:
    return bool(UsdGeom.Imageable(prim).ComputeVisibility() != UsdGeom.Tokens.invisible)


def test_a_visibility_over_time_is_refused(tmp_path: Path) -> None:
    stage = _written(tmp_path, opens_cut=False)
    shown = UsdGeom.Imageable(stage.GetPrimAtPath(SHOWN.AppendChild("Bone")))
    shown.GetVisibilityAttr().Set("invisible", 1.0)
    with pytest.raises(StageError, match="values over time"):
        read_appearances(stage)

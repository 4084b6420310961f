"""Bundle and exports leave out the prims that a layer deactivates."""

from pathlib import Path

import pytest
from pxr import Usd, UsdGeom

from stereocell.engine.run import Engine
from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.usd.validate import validate_stage
from support.bundles import load, write_bundle
from support.deactivated import PARTS, deactivate
from support.stages import BALL_ID, F_ID, NAMES, TILES, write_whole


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


EVERY = {f"{channel}_{tile}" for channel in (F_ID, BALL_ID) for tile in TILES}
GONE = {
    "a tile": {f"{F_ID}_r0_c0", f"{BALL_ID}_r0_c0"},
    "a channel": {f"{F_ID}_{tile}" for tile in TILES},
    "a channel in a tile": {f"{F_ID}_r0_c0"},
    "a mesh": {f"{F_ID}_r0_c0"},
    "a level of detail": {f"{F_ID}_r0_c0"},
}


@pytest.mark.parametrize("part", PARTS)
def test_a_flattened_stage_leaves_out_a_deactivated_part(
    stage_path: Path, tmp_path: Path, part: str
) -> None:
    layer = deactivate(part, tmp_path / "edited.usda", stage_path)
    flat = tmp_path / "flat.usdc"
    export_stage(layer, flat, options=ExportOptions(lod=0))
    stage = Usd.Stage.Open(str(flat))
    meshes = {prim.GetName() for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)}
    assert meshes == EVERY - GONE.get(part, set())
    assert validate_stage(flat) == []


@pytest.mark.slow
@pytest.mark.parametrize("part", PARTS)
def test_a_bundle_leaves_out_a_deactivated_part(
    stage_path: Path, tmp_path: Path, part: str
) -> None:
    layer = deactivate(part, tmp_path / "edited.usda", stage_path)
    write_bundle(layer, tmp_path / "bundle", None, engine=Engine(0))
    manifest = load(tmp_path / "bundle" / "manifest.json")
    assert [tile["id"] for tile in manifest["tiles"]] == list(TILES[part == "a tile" :])
    assert [channel["name"] for channel in manifest["channels"]] == list(
        NAMES[part == "a channel" :]
    )
    drawn = {
        f"{file.parts[-3]}_{file.parts[-2]}" for file in (tmp_path / "bundle").rglob("lod0.glb")
    }
    assert drawn == EVERY - GONE.get(part, set())
    entries = [load(tmp_path / "bundle" / c["volumes"]["path"]) for c in manifest["channels"]]
    count = sum(len(entry["volumes"]) for entry in entries)
    gone = {"a tile": 3, "a channel": 2, "a channel in a tile": 1, "a volume": 1}
    assert count == 6 - gone.get(part, 0)

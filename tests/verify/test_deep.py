"""`check --deep` passes a build, and names each fault that the test adds."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from pxr import Sdf, Usd, Vt

from stereocell.cli.__main__ import main
from stereocell.engine.run import Engine
from stereocell.formats.exr import read_atlas, write_atlas
from stereocell.formats.ktx2 import encode_2d, encode_3d
from stereocell.model.errors import SourceError
from stereocell.usd.written_files import digest_of, read_stage_list, write_list
from stereocell.verify import deep
from stereocell.verify.bundle_files import read_texels
from stereocell.verify.check_line import CheckLine
from stereocell.verify.deep import check_deep
from support import phantoms
from support.exhaustive import sweep
from support.sealed_files import edit_sealed
from support.validators import make_assets

TILE = "stage/tiles/r0_c0/tile.usdc"


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("deep")
    body = phantoms.f_phantom(2)
    source = phantoms.write_ome_tiff(folder / "f.ome.tif", body[None], "CZYX", names=["F"])
    assert make_assets(source, folder / "out", "2x1", "--workers", "0", plan=("--maps",)) == 0
    return folder / "out"


@pytest.fixture
def out(built: Path, tmp_path: Path) -> Path:
    return shutil.copytree(built, tmp_path / "out")


def lines_of(out: Path) -> dict[str, CheckLine]:
    return {line.name: line for line in check_deep(out, Engine(0))}


def failures(out: Path) -> dict[str, str]:
    return {name: line.detail for name, line in lines_of(out).items() if not line.ok}


def edit_mesh(
    out: Path, change: Callable[[Sdf.AttributeSpec], None], name: str, within: str = "lod=lod0"
) -> None:
    """Change an attribute of the finest mesh of r0_c0, or of another prim, in its own layer."""
    layer = Sdf.Layer.FindOrOpen(str(out / TILE))
    found: list[Sdf.Path] = []
    layer.Traverse(
        Sdf.Path.absoluteRootPath,
        lambda path: found.append(path) if path.name == name and within in str(path) else None,
    )
    assert len(found) == 1, found
    change(layer.GetAttributeAtPath(found[0]))
    assert layer.Save()
    layer.Reload(True)


def move_a_vertex(out: Path) -> None:
    def change(points: Sdf.AttributeSpec) -> None:
        moved = np.array(points.default)
        moved[len(moved) // 2] += (0, 0, 9)
        points.default = Vt.Vec3fArray.FromNumpy(moved)

    edit_mesh(out, change, "points")


def swap_axes(out: Path) -> None:
    def change(points: Sdf.AttributeSpec) -> None:
        swapped = np.ascontiguousarray(np.array(points.default)[:, [1, 0, 2]])
        points.default = Vt.Vec3fArray.FromNumpy(swapped)

    edit_mesh(out, change, "points")


def state_half_the_distance(out: Path) -> None:
    def change(distance: Sdf.AttributeSpec) -> None:
        distance.default = distance.default / 2

    edit_mesh(out, change, "stereocell:distance")


def turn_inside_out(out: Path) -> None:
    def turn(indices: Sdf.AttributeSpec) -> None:
        turned = np.ascontiguousarray(np.array(indices.default).reshape(-1, 3)[:, ::-1].ravel())
        indices.default = Vt.IntArray.FromNumpy(turned)

    def flip(normals: Sdf.AttributeSpec) -> None:
        normals.default = Vt.Vec3fArray.FromNumpy(-np.array(normals.default))

    edit_mesh(out, turn, "faceVertexIndices")
    edit_mesh(out, flip, "normals")


def shade_by_other_normals(out: Path) -> None:
    def turn(normals: Sdf.AttributeSpec) -> None:
        turned = np.ascontiguousarray(np.array(normals.default)[:, [1, 2, 0]])
        normals.default = Vt.Vec3fArray.FromNumpy(turned)

    edit_mesh(out, turn, "normals")


def hide_all_vertices(out: Path) -> None:
    def change(openness: Sdf.AttributeSpec) -> None:
        openness.default = Vt.FloatArray.FromNumpy(np.zeros_like(np.array(openness.default)))

    edit_mesh(out, change, "primvars:occlusion")


def mirror_the_uvs(out: Path) -> None:
    def change(uvs: Sdf.AttributeSpec) -> None:
        mirrored = np.ascontiguousarray(np.array(uvs.default)[:, ::-1])
        uvs.default = Vt.Vec2fArray.FromNumpy(mirrored)

    edit_mesh(out, change, "primvars:st", "lod=lod1")


def name_another_vdb(out: Path, field: str = "density") -> None:
    def change(path: Sdf.AttributeSpec) -> None:
        path.default = Sdf.AssetPath("../r0_c1/F.vdb")

    edit_mesh(out, change, "filePath", f"F_r0_c0_volume/{field}.")


def name_other_measured_voxels(out: Path) -> None:
    name_another_vdb(out, "measured")


def double_the_iso_value(out: Path) -> None:
    stage = Usd.Stage.Open(str(out / "stage" / "looks" / "channels.usda"))
    value = stage.GetPrimAtPath("/Specimen/Channels/F").GetAttribute("stereocell:isoValue")
    value.Set(2 * value.Get())
    stage.GetRootLayer().Save()


def double_the_threshold_and_window(out: Path) -> None:
    stage = Usd.Stage.Open(str(out / "stage" / "looks" / "channels.usda"))
    prim = stage.GetPrimAtPath("/Specimen/Channels/F")
    for name in ("threshold", "volumeWindow"):
        value = prim.GetAttribute(f"stereocell:{name}")
        value.Set(2 * value.Get())
    stage.GetRootLayer().Save()


def edit_tileset(out: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Change every tile of the channel's tileset."""
    file = out / "bundle" / "channels" / "F" / "tileset.json"
    tileset = json.loads(file.read_bytes())
    waiting = [tileset["root"]]
    while waiting:
        tile = waiting.pop()
        waiting += tile.get("children", [])
        change(tile)
    file.write_text(json.dumps(tileset))


def turn_the_tileset(out: Path) -> None:
    matrix = [0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    edit_tileset(out, lambda tile: tile.update(transform=matrix))


def shrink_the_boxes(out: Path) -> None:
    box = [1, 1, 1, 1e-7, 0, 0, 0, 1e-7, 0, 0, 0, 1e-7]
    edit_tileset(out, lambda tile: tile.update(boundingVolume={"box": box}))


def overstate_the_errors(out: Path) -> None:
    edit_tileset(out, lambda tile: tile.update(geometricError=1000 * tile["geometricError"]))


def move_the_bounds(out: Path) -> None:
    def move(manifest: dict[str, Any]) -> None:
        manifest["tiles"][0]["bounds_um"]["min"][0] -= 1

    edit_sealed(out / "bundle" / "manifest.json", move)


def empty_the_bricks(out: Path) -> None:
    file = out / "bundle" / "volumes" / "r0_c0" / "F_bricks.ktx2"
    (bricks,) = read_texels(file)
    file.write_bytes(encode_3d([np.zeros_like(bricks)]).data)


def empty_the_histogram(out: Path) -> None:
    file = out / "bundle" / "channels" / "F" / "histogram2d.ktx2"
    file.write_bytes(encode_2d(np.zeros_like(read_texels(file)[0][0])).data)


def invert_the_lookup_table(out: Path) -> None:
    file = out / "bundle" / "luts" / "F.ktx2"
    rows = read_texels(file)[0][0].copy()
    rows[..., 0] = 255 - rows[..., 0]
    file.write_bytes(encode_2d(rows).data)


def narrow_the_lookup_table(out: Path) -> None:
    file = out / "bundle" / "luts" / "F.ktx2"
    file.write_bytes(encode_2d(np.ascontiguousarray(read_texels(file)[0][0][:, :-1])).data)


def drop_a_tile(out: Path) -> None:
    stage = Usd.Stage.Open(str(out / "stage" / "contents.usda"), Usd.Stage.LoadNone)
    stage.RemovePrim("/Specimen/Tiles/r0_c1")
    stage.GetRootLayer().Save()


def change_a_colour(out: Path) -> None:
    stage = Usd.Stage.Open(str(out / "stage" / "looks" / "channels.usda"))
    stage.GetPrimAtPath("/Specimen/Channels/F").GetAttribute("inputs:color").Set((0.2, 0.9, 0.1))
    stage.GetRootLayer().Save()


def leave_a_texture_stale(out: Path) -> None:
    file = out / "stage" / "tiles" / "r0_c0" / "F_lod1_normal.png"
    with Image.open(file) as image:
        mirrored = image.transpose(Image.Transpose.FLIP_LEFT_RIGHT)
    mirrored.save(file)
    # The stage's hashes are updated, as if the build had written this file. Otherwise no bundle
    # would be made of it, because the file would count as damaged.
    (out / "stage" / "files.json").unlink()
    write_list(out / "stage", {}, out / "stage")
    digest = digest_of(read_stage_list(out / "stage"))
    edit_sealed(out / "phases.json", lambda phases: phases["stage"].update(results=digest))


def spoil_a_voxel(out: Path) -> None:
    file = out / "stage" / "tiles" / "r0_c0" / "F.exr"
    volume = read_atlas(file).copy()
    volume[5, 6, 7] ^= 1
    write_atlas(file, volume)


def rename_a_channel(out: Path) -> None:
    def rename(manifest: dict[str, Any]) -> None:
        manifest["channels"][0]["name"] = "G"

    edit_sealed(out / "bundle" / "manifest.json", rename)


def choose_the_volume(out: Path) -> None:
    stage = Usd.Stage.Open(str(out / "stage" / "stage.usda"))
    tile = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0")
    tile.GetVariantSet("representation").SetVariantSelection("volume")
    stage.GetRootLayer().Save()


def lose_a_level(out: Path) -> None:
    for file in (out / "bundle" / "channels" / "F").rglob("tileset.json"):
        tileset = json.loads(file.read_bytes())
        waiting = [tileset["root"]]
        while waiting:
            tile = waiting.pop()
            waiting += tile.get("children", [])
            if "r0_c1/lod2.glb" in tile.get("content", {}).get("uri", ""):
                del tile["content"]
        file.write_text(json.dumps(tileset))


@pytest.mark.slow
def test_a_build_agrees_with_its_source_and_its_bundle(
    built: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(built), "--deep", "--workers", "0"]) == 0
    printed = capsys.readouterr().out
    assert "ok   F lod0 against source: 2 surfaces within " in printed
    assert (
        "ok   F against source: 2 units: surfaces within the stated distances, "
        "volumes equal to the source" in printed
    )
    assert "2 volumes, all voxels of all resolution levels" in printed
    found = lines_of(built)["F lod3 against source"].detail.split()
    within, stated = float(found[3]), float(found[8].rstrip(");"))
    assert 0 < within <= stated * 1.02


FINEST = "F lod0 against source"
SOURCE, BUNDLE, MANIFEST = "F against source", "bundle against stage", "manifest against stage"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (
            move_a_vertex,
            {
                FINEST: "); largest distance ",
                SOURCE: "r0_c0/F: lod0: ",
                BUNDLE: "r0_c0/F: lod0: a vertex is ",
            },
        ),
        pytest.param(
            swap_axes,
            {
                FINEST: "); largest distance ",
                SOURCE: "um to the iso-surface, expected",
                BUNDLE: "lod0: a vertex is",
            },
            marks=pytest.mark.exhaustive,  # the lines are those of the moved vertex
        ),
        (state_half_the_distance, {FINEST: "); largest distance ", SOURCE: "lod0: "}),
        (
            drop_a_tile,
            {
                "tiles of the stage": "r0_c1 is missing",
                MANIFEST: "tiles are r0_c0, r0_c1, expected r0_c0 as in the stage",
                BUNDLE: "F: its histogram of value and gradient differs from its volumes",
            },
        ),
        (
            shade_by_other_normals,
            {
                FINEST: "); largest distance ",
                SOURCE: "r0_c0/F: lod0: differs from the unit in its normals",
                BUNDLE: "of its area has other normals",
            },
        ),
        (
            hide_all_vertices,
            {
                FINEST: "); largest distance ",
                SOURCE: "r0_c0/F: lod0: differs from the unit in its occlusion at vertices",
                BUNDLE: "of its area has other colours or occlusion at its",
            },
        ),
        (
            double_the_threshold_and_window,
            # The bundle's voxels are right, because measured voxels need no volumeWindow.
            {SOURCE: "F: volumeWindow is ", MANIFEST: "F: threshold_normalized is "},
        ),
        (change_a_colour, {MANIFEST: "F: color is ", BUNDLE: "its colour is "}),
        (
            leave_a_texture_stale,
            {
                "F lod1 against source": "); largest distance ",
                SOURCE: "r0_c0/F: lod1: differs from the unit in its normal map",
                BUNDLE: "F_lod1_normal.png differs from the image in the stage",
            },
        ),
        (
            spoil_a_voxel,
            {SOURCE: "F.exr: 1 of ", BUNDLE: "F.ktx2: resolution level 0: 1 of "},
        ),
        (
            choose_the_volume,
            {BUNDLE: "r0_c0: representation is 'mesh', expected 'volume' as in the stage"},
        ),
        (lose_a_level, {BUNDLE: "r0_c1/F: the bundle lacks lod2"}),
        (rename_a_channel, {MANIFEST: "F: name is 'G', expected 'F' as in the stage"}),
        (
            turn_inside_out,
            {
                FINEST: "); largest distance ",
                SOURCE: "lod0: its triangles face inwards",
                BUNDLE: "lod0: 100% of its area faces the other way",
            },
        ),
        (
            mirror_the_uvs,
            {
                "F lod1 against source": "); largest distance ",
                SOURCE: "lod1: differs from the unit in its UVs",
                BUNDLE: "of its area has other texture coordinates",
            },
        ),
        (name_another_vdb, {SOURCE: "F.vdb: differs from the file that the source gives"}),
        (name_other_measured_voxels, {SOURCE: "its measured voxels: found "}),
        (double_the_iso_value, {SOURCE: "F: isoValue is ", MANIFEST: "F: iso_value is "}),
        (turn_the_tileset, {BUNDLE: "tileset.json: found a tile with a transform"}),
        (shrink_the_boxes, {BUNDLE: "a box of the tileset does not fit the surfaces"}),
        (overstate_the_errors, {BUNDLE: "lod1: the tileset states "}),
        (
            move_the_bounds,
            {MANIFEST: "specimen: bounds_um is ", BUNDLE: "r0_c0: bounds_um is "},
        ),
        (empty_the_bricks, {BUNDLE: "F_bricks.ktx2: the least and largest values of bricks"}),
        (empty_the_histogram, {BUNDLE: "F: its histogram of value and gradient differs"}),
        (invert_the_lookup_table, {MANIFEST: "F: the lookup table of 'default' differs"}),
        (narrow_the_lookup_table, {MANIFEST: "F: found a lookup table of 5 x 255 x 4 values"}),
    ],
)
def test_a_fault_put_in_by_hand_is_named(
    out: Path, spoil: Callable[[Path], None], expected: dict[str, str]
) -> None:
    spoil(out)
    found = failures(out)
    assert found.keys() == expected.keys(), found
    for name, part in expected.items():
        assert part in found[name]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "part"),
    sweep(
        [
            (leave_a_texture_stale, "r0_c0/F: lod1: differs from the unit in its normal map"),
            (shade_by_other_normals, "r0_c0/F: lod0: differs from the unit in its normals"),
            (
                hide_all_vertices,
                "r0_c0/F: lod0: differs from the unit in its occlusion at vertices",
            ),
        ],
        kept=[(leave_a_texture_stale, "r0_c0/F: lod1: differs from the unit in its normal map")],
    ),
)
def test_a_fault_of_the_stage_is_named_when_the_bundle_has_it_too(
    out: Path, spoil: Callable[[Path], None], part: str
) -> None:
    spoil(out)
    os.utime(out / "stage" / "tiles" / "r0_c0" / "tile.usdc")  # an edit
    assert main(["bundle", str(out), "--workers", "0"]) == 0
    found = failures(out)
    assert found.keys() <= {FINEST, "F lod1 against source", SOURCE}
    assert part in found[SOURCE]


@pytest.mark.slow
def test_a_bundle_of_another_layer_is_reported_as_different_from_the_stage(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    layer = tmp_path / "edit.usda"
    stage = Usd.Stage.CreateNew(str(layer))
    stage.GetRootLayer().subLayerPaths.append(str(out / "stage" / "stage.usda"))
    prim = stage.GetPrimAtPath("/Specimen/Channels/F")
    variants = prim.GetVariantSet("transferFunction")
    chosen = variants.GetVariantSelection()
    variants.AddVariant("mine")
    variants.SetVariantSelection("mine")
    with variants.GetVariantEditContext():
        points = Vt.Vec2fArray([(0, 0), (1, 0.5)])
        prim.GetAttribute("stereocell:opacityPoints").Set(points)
    variants.SetVariantSelection(chosen)
    prim.CreateAttribute("inputs:colour", Sdf.ValueTypeNames.Color3f).Set((0, 1, 0))
    stage.GetRootLayer().Save()
    flags = ["--stage", str(layer)]
    assert main(["bundle", str(out), *flags, "--workers", "0"]) == 0
    found = failures(out)
    assert found.keys() == {MANIFEST}
    assert "F: transfer_functions is ['default', 'mine'" in found[MANIFEST]
    remedy = f"; the bundle is of {layer.name}: check it with --stage LAYER"
    assert found[MANIFEST].endswith(remedy)
    capsys.readouterr()
    assert main(["check", str(out), "--deep", "--workers", "0", *flags]) == 0
    line = (
        "ok   edits of the stage: /Specimen/Channels/F.inputs:colour is not taken over: no reader"
    )
    assert line in capsys.readouterr().out


def push_the_finest(stage: Usd.Stage) -> None:
    tile = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0")
    variants = tile.GetVariantSet("lod")
    variants.SetVariantSelection("lod0")
    with variants.GetVariantEditContext():
        points = stage.GetAttributeAtPath("/Specimen/Tiles/r0_c0/F/F_r0_c0.points")
        moved = np.array(points.Get(), np.float64)
        moved[:, 2] += 3 * np.exp(-(((moved[:, 1] - moved[:, 1].mean()) / 3) ** 2))
        points.Set(Vt.Vec3fArray.FromNumpy(moved.astype(np.float32)))
    variants.ClearVariantSelection()


@pytest.mark.slow
def test_a_bundle_of_an_edited_mesh_is_compared_with_the_edited_mesh(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    layer = tmp_path / "an artist's edit.usda"
    stage = Usd.Stage.CreateNew(str(layer))
    stage.GetRootLayer().subLayerPaths.append(str(out / "stage" / "stage.usda"))
    push_the_finest(stage)
    stage.GetRootLayer().Save()
    flags = ["--stage", str(layer)]
    assert main(["bundle", str(out), *flags, "--workers", "0"]) == 0
    edit = "r0_c0/F: edited by hand: lod0 (sound); rebuilt from lod0: lod1 within "
    assert f"bundle: {edit}" in capsys.readouterr().err
    assert main(["check", str(out), "--deep", "--workers", "0", *flags]) == 0
    assert edit in capsys.readouterr().out
    assert "lod1: " in failures(out)[BUNDLE]  # compared with the stage without the edit
    # A bundle of the edit that still has the unedited stage's coarser levels and errors is a fault.
    file = out / "bundle" / "channels" / "F" / "r0_c0" / "lod1.glb"
    edited = file.read_bytes()
    assert main(["bundle", str(out), "--workers", "0"]) == 0
    as_built = file.read_bytes()
    assert as_built != edited
    assert main(["bundle", str(out), *flags, "--workers", "0"]) == 0
    file.write_bytes(as_built)
    line = {line.name: line for line in check_deep(out, Engine(0), layer)}[BUNDLE]
    assert not line.ok
    assert "r0_c0/F: lod1: " in line.detail


@pytest.mark.slow
def test_a_bundle_is_compared_with_the_stage_even_without_the_source(
    built: Path, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: object) -> None:
        raise SourceError("f.ome.tif: not found")

    monkeypatch.setattr(deep, "require_input", refuse)
    found = lines_of(out)
    assert {name: line.detail for name, line in found.items() if not line.ok} == {
        "stage against source": "f.ome.tif: not found"
    }
    assert {MANIFEST, BUNDLE} <= found.keys()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["channels/F/r0_c0/lod0.glb", "volumes/r0_c1/F.ktx2"])
def test_a_cut_file_is_named_in_a_line(out: Path, name: str) -> None:
    file = out / "bundle" / name
    file.write_bytes(file.read_bytes()[:300])
    line = failures(out)[BUNDLE]
    assert f"{file}: can't be decoded: " in line
    assert "\n" not in line

"""The Blender add-on in headless Blender, from the import to a bundle with the exported edits.

`make test-blender` runs these tests. Blender's Python is a separate environment, which
STEREOCELL_BLENDER names. blender/session.py has the steps that run there.
"""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from pxr import Sdf, Usd, UsdGeom, Vt

from stereocell.cli.__main__ import main
from stereocell.engine.run import Engine
from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.formats.gltf_decode import read_glb
from stereocell.formats.vdb import write_vdb
from stereocell.model.identifiers import to_identifier
from stereocell.samples.cells import table_beside, write_cells
from stereocell.storage.overwriting import forcing
from stereocell.usd.validate import validate_stage
from support.blender_session import NEEDS_BLENDER, run
from support.bundles import load, write, write_bundle
from support.glbs import read
from support.stages import BALL_ID, COLORS, F_ID, FUNCTIONS, NAMES, TILES, leaf, write_whole

pytestmark = NEEDS_BLENDER


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


def test_meshes_have_their_size_place_and_colour(stage_path: Path, tmp_path: Path) -> None:
    found = run("import", tmp_path, stage=stage_path, lod="lod0")
    meshes = found["meshes"]
    assert set(meshes) == {leaf(t, c) for t in ("r0_c0", "r0_c1") for c in (F_ID, BALL_ID)}
    assert not found["volumes"]  # the stage selects meshes only
    for path, mesh in meshes.items():
        color = COLORS[0] if F_ID in path else COLORS[1]
        assert mesh["color"] == pytest.approx(color, abs=1e-6)
    stage = Usd.Stage.Open(str(stage_path))
    for tile in ("r0_c0", "r0_c1"):
        stage.GetPrimAtPath(f"/Specimen/Tiles/{tile}").GetVariantSet("lod").SetVariantSelection(
            "lod0"
        )
        points = np.array(stage.GetPrimAtPath(leaf(tile, F_ID)).GetAttribute("points").Get())
        mesh = meshes[leaf(tile, F_ID)]
        assert np.allclose(
            [mesh["low"], mesh["high"]], [points.min(axis=0), points.max(axis=0)], atol=1e-4
        )
        # One unit is 1 um. The stage's up axis, y, becomes Blender's z.
        assert mesh["world"] == pytest.approx(np.ptp(points, axis=0), abs=1e-4)
    assert found["unit"] == pytest.approx(1e-6)


@pytest.fixture(scope="module")
def cells(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Build a small tissue; return the build's folder and the table of its cells."""
    folder = tmp_path_factory.mktemp("a tissue's")
    sample, out = folder / "small.ome.zarr", folder / "out"
    write_cells(sample, seed=2, shape=(24, 60, 60))
    table = table_beside(sample)
    flags = ["--channels", "DNA", "--labels", "cells", "--table", str(table)]
    assert main(["plan", str(sample), "-o", str(out), *flags]) == 0
    for phase in ("units", "stage", "bundle"):
        assert main([phase, str(out), "--workers", "0"]) == 0
    return out, table


def test_objects_are_coloured_hidden_and_renamed_up_to_the_bundle(
    cells: tuple[Path, Path], tmp_path: Path
) -> None:
    out, table = cells
    by_label = {row["CellID"]: row for row in csv.DictReader(table.read_text("utf-8").splitlines())}
    kinds = sorted({row["cell_type"] for row in by_label.values()})
    stage, overlay = out / "stage/stage.usda", tmp_path / "edit.usda"
    found = run(
        "edit_objects", tmp_path, stage=stage, overlay=overlay, lod="lod1", low=300.0,
        **{"class": "cell_type/0"},
    )  # fmt: skip
    labels = found["labels"]
    of_class = [i for i, one in enumerate(labels) if by_label[one]["cell_type"] == kinds[0]]
    assert found["selected"] == of_class
    assert found["fed by"] == "ShaderNodeValToRGB"
    assert found["color"] == pytest.approx([0, 0.25, 1], abs=1e-6)
    gone = {one for one in labels if not float(by_label[one]["CD3"]) >= 300}
    assert 0 < len(gone) < len(labels)
    before, after, whole = found["faces"]
    assert before == whole > after > 0
    assert validate_stage(overlay) == []
    bundle = tmp_path / "bundle"
    write_bundle(overlay, bundle, None, engine=Engine(0))
    content = load(bundle / "channels/cells/objects.json")
    left = np.fromfile(bundle / content["labels"]["path"], "<u4")
    assert {str(label) for label in left} == set(labels) - gone
    assert content["default"] == ""  # the last edit coloured single objects
    (kind,) = (one for one in content["columns"] if one["id"] == "cell_type")
    assert kind["categories"] == ["it's mine", *kinds[1:]]
    for level in range(4):
        drawn = read_glb(bundle / f"channels/cells/r0_c0/lod{level}.glb")
        own = np.array([by_label[str(label)]["cell_type"] == kinds[0] for label in left])
        is_blue = np.abs(drawn.colors - [0, 0.25, 1]).max(axis=1) < 0.01
        assert np.array_equal(is_blue, own[drawn.objects])


def test_changes_of_the_display_are_not_edits_of_a_material(
    cells: tuple[Path, Path], tmp_path: Path
) -> None:
    """Nodes that show a column, and the modifier that hides objects, are not reported as lost."""
    overlay = tmp_path / "edit.usda"
    found = run(
        "edit_objects", tmp_path, stage=cells[0] / "stage/stage.usda", overlay=overlay, low=300.0,
        **{"class": "cell_type/1", "shown again": True},
    )  # fmt: skip
    assert found["faces"][3] == found["faces"][2]
    attribute = Sdf.Layer.FindOrOpen(str(overlay)).GetAttributeAtPath(
        "/Specimen/Channels/cells.stereocell:hiddenObjects"
    )
    assert attribute is None
    ((kind, message),) = found["messages"]
    assert kind == "Info", message


def test_objects_have_their_columns_and_classes(cells: tuple[Path, Path], tmp_path: Path) -> None:
    """A column becomes an attribute of faces; a category becomes a material slot in its colour."""
    out, table = cells
    found = run("objects", tmp_path, stage=out / "stage/stage.usda", lod="lod1")
    mesh = found[leaf("r0_c0", "cells")]
    rows = list(csv.DictReader(table.read_text("utf-8").splitlines()))
    stage = Usd.Stage.Open(str(out / "stage/stage.usda"))
    labels = stage.GetPrimAtPath(leaf("r0_c0", "cells")).GetAttribute("stereocell:objectLabels")
    numbers = [int(label) for label in labels.Get()]
    objects = [int(place) for place in mesh["columns"]["objectId"]]
    assert set(objects) == set(range(len(numbers)))
    kinds = sorted({row["cell_type"] for row in rows})
    for face in range(0, len(objects), 97):
        row = rows[numbers[objects[face]] - 1]
        assert mesh["columns"]["CD3"][face] == pytest.approx(float(row["CD3"]), rel=1e-4)
        assert kinds[int(mesh["columns"]["cell_type"][face])] == row["cell_type"]
        assert to_identifier(row["cell_type"]) in mesh["classes"][face]
    content = json.loads((out / "bundle/channels/cells/objects.json").read_text("utf-8"))
    (entry,) = (one for one in content["columns"] if one["id"] == "cell_type")
    for name, color in zip(entry["categories"], entry["colors"], strict=True):
        (found_color,) = (
            own for slot, own in mesh["colors"].items() if slot.endswith(to_identifier(name))
        )
        assert found_color == pytest.approx(color, abs=1e-3)


def test_true_size_is_metres(stage_path: Path, tmp_path: Path) -> None:
    found = run("import", tmp_path, stage=stage_path, size="TRUE", representation="both")
    assert found["root_scale"] == pytest.approx([1e-6] * 3)
    assert found["unit"] == pytest.approx(1)
    height = (
        found["meshes"][leaf("r0_c0", F_ID)]["high"][1]
        - found["meshes"][leaf("r0_c0", F_ID)]["low"][1]
    )
    assert height == pytest.approx(36 * 0.25, rel=0.03)  # in the stage's own um
    assert not [volume["error"] for volume in found["volumes"].values() if volume["error"]]


def test_display_size_is_metres_enlarged(stage_path: Path, tmp_path: Path) -> None:
    found = run("import", tmp_path, stage=stage_path, size="DISPLAY")
    assert found["root_scale"] == pytest.approx([1e-2] * 3)  # 12 um as 0.12 m
    assert found["unit"] == pytest.approx(1)


def test_tiles_and_variants_are_chosen_at_the_import(stage_path: Path, tmp_path: Path) -> None:
    found = run(
        "import", tmp_path, stage=stage_path, tiles="x*, r0_c1", lod="lod3",
        representation="both", transfer_function="sharp",
    )  # fmt: skip
    assert set(found["meshes"]) == {leaf("r0_c1", c) for c in (F_ID, BALL_ID)}
    assert len(found["volumes"]) == 3
    stage = Usd.Stage.Open(str(stage_path))
    tile = stage.GetPrimAtPath("/Specimen/Tiles/r0_c1")
    tile.GetVariantSet("lod").SetVariantSelection("lod2")  # the coarsest that it has
    faces = stage.GetPrimAtPath(leaf("r0_c1", F_ID)).GetAttribute("faceVertexCounts").Get()
    assert found["meshes"][leaf("r0_c1", F_ID)]["faces"] == len(faces)
    assert np.allclose(found["functions"][F_ID], FUNCTIONS["sharp"])


def test_the_dialog_offers_the_transfer_functions_that_all_channels_have(
    stage_path: Path, tmp_path: Path
) -> None:
    assert run("find_functions", tmp_path, stage=stage_path) == sorted(FUNCTIONS)
    layer = tmp_path / "over.usda"
    stage = Usd.Stage.CreateNew(str(layer))
    stage.GetRootLayer().subLayerPaths = [str(stage_path)]
    stage.SetMetadata("metersPerUnit", 1e-6)
    stage.SetMetadata("upAxis", "Y")
    *others, last = stage.GetPrimAtPath("/Specimen/Channels").GetChildren()

    def add_bone(channel: Usd.Prim) -> None:
        variants = channel.GetVariantSet("transferFunction")
        variants.AddVariant("bone")
        variants.SetVariantSelection("bone")
        with variants.GetVariantEditContext():
            channel.GetAttribute("stereocell:opacityPoints").Set([(0, 0), (0.75, 0.5)])
        variants.ClearVariantSelection()

    for channel in others:
        add_bone(channel)
    stage.Save()
    assert "bone" not in run("find_functions", tmp_path, stage=layer)
    add_bone(last)
    stage.Save()
    assert "bone" in run("find_functions", tmp_path, stage=layer)
    found = run("import", tmp_path, stage=layer, transfer_function="bone", representation="volume")
    assert np.allclose(found["functions"][F_ID], [(0, 0), (0.75, 0.5)])
    assert run("find_functions", tmp_path, stage=tmp_path / "no.usda") == []


def test_a_function_of_more_points_than_a_ramp_holds_is_followed_closely(
    stage_path: Path, tmp_path: Path
) -> None:
    """Blender's ramps have at most 32 points; this function has 100."""
    x = np.linspace(0, 1, 100)
    points = np.stack([x, 0.5 + 0.4 * np.sin(6 * x)], axis=-1).astype(np.float32)
    layer = tmp_path / "over.usda"
    stage = Usd.Stage.CreateNew(str(layer))
    stage.GetRootLayer().subLayerPaths = [str(stage_path)]
    stage.SetMetadata("metersPerUnit", 1e-6)
    stage.SetMetadata("upAxis", "Y")
    channel = stage.GetPrimAtPath(f"/Specimen/Channels/{F_ID}")
    variants = channel.GetVariantSet("transferFunction")
    with variants.GetVariantEditContext():
        channel.GetAttribute("stereocell:opacityPoints").Set(Vt.Vec2fArray.FromNumpy(points))
    stage.Save()
    found = run("import", tmp_path, stage=layer, representation="volume")
    ramp = np.array(found["functions"][F_ID])
    assert len(ramp) <= 32
    assert ramp[[0, -1]] == pytest.approx(points[[0, -1]])
    assert np.interp(x, *ramp.T) == pytest.approx(points[:, 1], abs=0.01)
    overlay = tmp_path / "edit.usda"
    edits = run("edit", tmp_path, stage=layer, representation="volume", overlay=overlay)
    ((_, message),) = edits["messages"]
    assert "representation volume" in message
    assert "opacities" not in message  # the ramp was not edited


def test_an_import_has_the_channels_that_the_stage_shows_or_all(
    stage_path: Path, tmp_path: Path
) -> None:
    layer = tmp_path / "over.usda"
    stage = Usd.Stage.CreateNew(str(layer))
    stage.GetRootLayer().subLayerPaths = [str(stage_path)]
    stage.SetMetadata("metersPerUnit", 1e-6)
    stage.SetMetadata("upAxis", "Y")
    UsdGeom.Imageable(stage.GetPrimAtPath(f"/Specimen/Shown/{F_ID}")).MakeInvisible()
    stage.Save()

    def channels_of(**chosen: str) -> set[str]:
        found = run("import", tmp_path, stage=layer, **chosen)
        return {path.split("/")[4] for path in found["meshes"]}

    shown = channels_of()
    assert F_ID not in shown
    assert channels_of(channels="ALL") == shown | {F_ID}


def test_objects_and_materials_have_display_names(stage_path: Path, tmp_path: Path) -> None:
    layer, overlay = tmp_path / "over.usda", tmp_path / "edit.usda"
    stage = Usd.Stage.CreateNew(str(layer))
    stage.GetRootLayer().subLayerPaths = [str(stage_path)]
    stage.SetMetadata("metersPerUnit", 1e-6)
    stage.SetMetadata("upAxis", "Y")
    stage.GetPrimAtPath(f"/Specimen/Channels/{F_ID}").SetDisplayName("CD31/µ 1")
    stage.Save()
    found = run("import", tmp_path, stage=layer, representation="both")
    assert found["meshes"][leaf("r0_c0", F_ID)]["name"] == "CD31/µ 1_r0_c0"
    assert found["meshes"][leaf("r0_c0", BALL_ID)]["name"] == f"{NAMES[1]}_r0_c0"
    assert found["volumes"][leaf("r0_c0", F_ID, "_volume")]["material"] == "CD31/µ 1 volume"
    # Names that the import gave are not edits.
    found = run("edit", tmp_path, stage=layer, overlay=overlay, representation="AS_STAGED")
    assert found["messages"] == [("Info", "0 edits: ")]


def test_volumes_have_their_grid_place_and_transfer_function(
    stage_path: Path, tmp_path: Path
) -> None:
    found = run("import", tmp_path, stage=stage_path, representation="volume")
    assert not found["meshes"]
    assert found["volumes"][leaf("r0_c0", F_ID, "_volume")]["grids"] == ["density"]
    assert all(volume["error"] == "" for volume in found["volumes"].values())
    # Blender's bounds are those of the bricks of 8^3 voxels that are not empty. The F has rows 6 to
    # 41, so its bricks have rows 0 to 47. Blender 5.0 bounds whole voxels, 4.5 their centres.
    box = found["volumes"][leaf("r0_c0", F_ID, "_volume")]
    assert [box["low"][1], box["high"][1]] == pytest.approx([-47.5 * 0.25, 0.5 * 0.25], abs=0.126)
    assert box["low"][0] == pytest.approx(-0.5 * 0.25, abs=0.126)
    assert [box["low"][2], box["high"][2]] == pytest.approx([-0.5 * 0.5, 15.5 * 0.5], abs=0.251)
    assert np.allclose(found["functions"][F_ID], FUNCTIONS["default"])
    assert found["colors"][F_ID] == pytest.approx(COLORS[0])


def test_measured_voxels_are_read_to_the_bit(tmp_path: Path) -> None:
    """OpenVDB itself reads floats in Blosc frames, negative indices and a negative background."""
    measured = np.random.default_rng(1).integers(-1024, 60000, (12, 23, 40)).astype(np.float32)
    measured[:, :9] = -1024
    write_vdb(
        tmp_path / "a.vdb",
        np.full((9, 20, 37), 255, np.uint8),
        first_um=(1.0, 2.0, 3.0),
        spacing_um=(1.0, 0.5, 0.25),
        measured=measured,
        apron=1,
    )
    z, y, x = (n - 1 for n in np.indices(measured.shape))
    points = np.stack([3 + 0.25 * x, -(2 + 0.5 * y), 1.0 + z], axis=-1).reshape(-1, 3)
    found = run("measured", tmp_path, vdb=tmp_path / "a.vdb", points=points.tolist())
    np.testing.assert_array_equal(found["values"], measured.ravel())


def test_cameras_are_a_stereo_pair(stage_path: Path, tmp_path: Path) -> None:
    cameras = run("import", tmp_path, stage=stage_path)["cameras"]
    left, mono, right = (cameras[name] for name in ("left", "mono", "right"))
    assert mono["lens"] == pytest.approx(35)
    assert mono["sensor"] == pytest.approx(36)
    assert mono["eyes"] == pytest.approx(right["at"][0] - left["at"][0])
    assert left["shift"] == pytest.approx(-right["shift"])
    # Off-axis cameras: both view windows have the same centre at the distance of convergence.
    window = mono["convergence"] * mono["sensor"] / mono["lens"]
    assert left["shift"] * window == pytest.approx(mono["eyes"] / 2, rel=1e-3)
    assert mono["clip"][0] < mono["convergence"] < mono["clip"][1]


def test_an_import_that_fails_gives_one_clear_line(stage_path: Path, tmp_path: Path) -> None:
    text = run("refuse", tmp_path, stage=stage_path, tiles="r9_*")
    assert "no tile fits 'r9_*'; there are r0_c0, r0_c1" in text
    other = tmp_path / "other.usda"
    other.write_text('#usda 1.0\n(defaultPrim = "A")\ndef Xform "A"\n{\n}\n')
    assert "no prim /Specimen/Tiles, expected a StereoCell stage" in run(
        "refuse", tmp_path, stage=other
    )


def test_an_export_without_edits_is_an_empty_layer(stage_path: Path, tmp_path: Path) -> None:
    overlay = tmp_path / "edit.usda"
    found = run(
        "edit", tmp_path, stage=stage_path, overlay=overlay, representation="AS_STAGED", size="TRUE"
    )
    assert found["messages"] == [("Info", "0 edits: ")]
    layer = Sdf.Layer.FindOrOpen(str(overlay))
    assert not layer.GetPrimAtPath("/Specimen").nameChildren
    assert not Path(layer.subLayerPaths[0]).is_absolute()
    assert validate_stage(overlay) == []


@pytest.mark.parametrize("size", ["MICROMETRES", "TRUE"])
def test_edits_reach_the_bundle(stage_path: Path, tmp_path: Path, size: str) -> None:
    overlay, bundle = tmp_path / "edit.usda", tmp_path / "bundle"
    points = [[0.0, 0.0], [0.25, 0.125], [1.0, 0.5]]
    offset = [3.0, -2.0, 1.0] if size == "MICROMETRES" else [300.0, -2000.0, 10.0]
    run(
        "edit", tmp_path, stage=stage_path, overlay=overlay, size=size, lod="lod2",
        representation="both", transfer_function="sharp", color=[F_ID, [0.25, 0.5, 0.75]],
        points=[BALL_ID, points], hide=["/Specimen/Tiles/r0_c1"],
        delete=[leaf("r0_c0", BALL_ID)], move={"/Specimen/Tiles/r0_c0": offset},
    )  # fmt: skip
    assert validate_stage(overlay) == []
    write_bundle(overlay, bundle, None, engine=Engine(0))
    manifest = load(bundle / "manifest.json")
    letter, ball, _ = manifest["channels"]
    assert letter["color"] == [0.25, 0.5, 0.75]
    assert ball["color"] == pytest.approx(COLORS[1])
    assert {channel["transfer_function"] for channel in manifest["channels"]} == {"sharp"}
    assert [tile["id"] for tile in manifest["tiles"]] == ["r0_c0"]
    (box,) = [tile["bounds_um"] for tile in manifest["tiles"]]
    assert box["min"] == pytest.approx(np.array([0, -11.75, 0]) + offset, rel=1e-4)
    assert letter["tileset"] is not None
    assert ball["tileset"] is None  # one half was deleted, the other is in the hidden tile
    stage = Usd.Stage.Open(str(overlay))
    prim = stage.GetPrimAtPath(f"/Specimen/Channels/{BALL_ID}")
    functions = prim.GetVariantSet("transferFunction")
    for name in FUNCTIONS:  # only the chosen one was edited
        functions.SetVariantSelection(name)
        found = np.array(prim.GetAttribute("stereocell:opacityPoints").Get())
        assert np.allclose(found, points if name == "sharp" else FUNCTIONS[name])
    tile = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0")
    assert tile.GetVariantSet("lod").GetVariantSelection() == "lod2"
    assert tile.GetVariantSet("representation").GetVariantSelection() == "both"


LETTER = leaf("r0_c0", F_ID)


def mesh_at(layer: Path, path: str, lod: str) -> UsdGeom.Mesh:
    """Return a mesh of a composed stage in one level of detail.

    The mesh keeps a reference to the stage, because it is invalid without it.
    """
    stage = Usd.Stage.Open(str(layer))
    tile = stage.GetPrimAtPath(Sdf.Path(path).GetParentPath().GetParentPath())
    tile.GetVariantSet("lod").SetVariantSelection(lod)
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(path))
    mesh.stage = stage
    return mesh


def array(attribute: Usd.Attribute) -> Any:
    return np.array(attribute.Get())


@pytest.mark.parametrize("size", ["MICROMETRES", "TRUE"])
@pytest.mark.parametrize("lod", ["lod0", "lod2"])
def test_moved_points_are_carried_with_their_extent_normals_and_tangents(
    stage_path: Path, tmp_path: Path, size: str, lod: str
) -> None:
    overlay = tmp_path / "an artist's edit.usda"
    top = -4.0  # um; the upper strokes of the F have a larger y
    found = run(
        "edit", tmp_path, stage=stage_path, overlay=overlay, size=size, lod=lod,
        pull={LETTER: [1, top, 1.5]},
    )  # fmt: skip
    ((kind, message),) = found["messages"]
    assert kind == "Info"
    assert f"{NAME}: points at {lod}" in message
    assert ("finer levels keep their shape" in message) == (lod != "lod0")
    assert validate_stage(overlay) == []
    built, edited = (mesh_at(path, LETTER, lod) for path in (stage_path, overlay))
    before, after = (array(mesh.GetPointsAttr()) for mesh in (built, edited))
    expected = before + np.where(before[:, 1] > top, 1.5, 0)[:, None] * [0, 1, 0]
    assert np.allclose(after, expected, atol=1e-5)  # the tile's own um
    assert np.allclose(edited.GetExtentAttr().Get(), [after.min(axis=0), after.max(axis=0)])
    normals, kept = (array(mesh.GetNormalsAttr()) for mesh in (edited, built))
    assert np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-3)
    triangles = array(built.GetFaceVertexIndicesAttr()).reshape(-1, 3)
    far = ~np.isin(
        np.arange(len(before)), triangles[(before != after).any(axis=1)[triangles].any(axis=1)]
    )
    # A vertex beside a moved one gets another normal, and so do its copies along a UV seam. The
    # copies may lie in other triangles, so no vertex near the edge of the moved part is compared.
    far &= (before[:, 1] < top - 1) | (before[:, 1] > top + 1)
    assert far.any()
    assert np.array_equal(normals[far], kept[far])
    # Normals of stretched walls follow their triangles.
    stretched = (before[triangles, 1].max(axis=1) > top) & (before[triangles, 1].min(axis=1) <= top)
    corners = after[triangles[stretched]]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])

    def agreement(vectors: Any) -> float:
        return float((vectors[triangles[stretched]].mean(axis=1) * facing).sum())

    assert agreement(normals) > agreement(kept)
    if lod == "lod2":  # only this level has tangents
        tangents = array(UsdGeom.PrimvarsAPI(edited).GetPrimvar("tangents"))
        across = (tangents[:, :3] * normals).sum(axis=1)
        before_it = array(UsdGeom.PrimvarsAPI(built).GetPrimvar("tangents"))[:, :3]
        assert np.allclose(across, (before_it * kept).sum(axis=1), atol=1e-4)
    other = "lod2" if lod == "lod0" else "lod0"
    assert np.array_equal(
        array(mesh_at(overlay, LETTER, other).GetPointsAttr()),
        array(mesh_at(stage_path, LETTER, other).GetPointsAttr()),
    )


def test_points_moved_in_edit_mode_are_carried(stage_path: Path, tmp_path: Path) -> None:
    overlay = tmp_path / "edit.usda"
    run(
        "edit", tmp_path, stage=stage_path, overlay=overlay, lod="lod0", tiles="r0_c0",
        odd=["work_in_edit_mode"],
    )  # fmt: skip
    built, edited = (mesh_at(path, LETTER, "lod0") for path in (stage_path, overlay))
    away = array(edited.GetPointsAttr()) - array(built.GetPointsAttr())
    assert np.allclose(away, [0, 0, 0.5], atol=1e-5)


@pytest.mark.parametrize("size", ["MICROMETRES", "TRUE"])
def test_moved_meshes_and_volumes_are_carried(stage_path: Path, tmp_path: Path, size: str) -> None:
    overlay = tmp_path / "edit.usda"
    volume = leaf("r0_c1", BALL_ID, "_volume")
    found = run(
        "edit", tmp_path, stage=stage_path, overlay=overlay, size=size, representation="both",
        move={LETTER: [1.0, 2.0, 3.0], volume: [0.0, -4.0, 0.0]},
    )  # fmt: skip
    ((kind, message),) = found["messages"]
    assert kind == "Info"
    assert "CD3_x3b5__r0_c0: moved" in message
    assert validate_stage(overlay) == []
    stage = Usd.Stage.Open(str(overlay))
    for path, expected in ((LETTER, (1, 2, 3)), (volume, (0, -4, 0)), (leaf("r0_c1", F_ID), None)):
        prim = UsdGeom.Xformable(stage.GetPrimAtPath(path))
        found_at = prim.GetLocalTransformation().ExtractTranslation()
        assert np.allclose(found_at, expected or (0, 0, 0), atol=1e-5)
        assert prim.GetXformOpOrderAttr().HasAuthoredValue() == (expected is not None)
    write_bundle(overlay, tmp_path / "bundle", None, engine=Engine(0))
    ball = load(tmp_path / "bundle" / "manifest.json")["channels"][1]
    entries = load(tmp_path / "bundle" / ball["volumes"]["path"])["volumes"]
    assert entries[1]["matrix"][12:] == pytest.approx([0, -4, 0, 1])


NAME = f"{NAMES[0]}_r0_c0"  # name of LETTER's object in Blender


@pytest.mark.parametrize(
    ("odd", "words"),
    [
        ("drop_a_face", f"topology of {NAME} is not taken over: its vertices"),
        ("add_a_vertex", f"topology of {NAME} is not taken over: its vertices"),
        ("rename", f'name "it\'s mine" of {NAME} is not taken over: the stage names its prims'),
        ("add_new", "arrow is not taken over: it has no faces"),
        ("add_a_probe", "is not taken over: nothing in the bundle is made of objects of this type"),
        ("add_a_spot", "spot light Spot is not taken over: the viewer's lamps are suns and points"),
        ("smooth_by_modifier", f"modifier Smooth of {NAME} is not taken over: apply it"),
        ("rewire_a_material", f"material {NAME}_look is not taken over, whose nodes changed"),
        ("replace_a_material", f"material of {NAME} is not taken over"),
        ("color_a_ramp", "volume is not taken over, whose nodes changed"),
        ("move_a_camera", "the place of mono is not taken over: add a camera of your own"),
        ("change_the_world", "the world is not taken over"),
        ("take_out", f"{NAME} is not taken over where it is: it was taken out of the specimen"),
        ("add_shape_keys", f"shape key of {NAME} is not taken over: apply it"),
        ("animate", f"animation of {NAME} is not taken over but for this frame"),
        ("paint_other_uvs", f"a change of UVs of {NAME} is not taken over"),
        ("instance_a_collection", "instances by pins are not taken over: make them real"),
        ("shift_a_camera", "shift of camera Close is not taken over: the viewer has none"),
        ("animate_an_arrow", "animation of arrow is not taken over but for this frame"),
        ("paint_without_a_principled_shader", "nodes of material neon are not taken over"),
        ("light_by_area", "strength by area of light Bulb is not taken over"),
    ],
)
def test_an_edit_that_a_layer_cannot_carry_is_listed_as_lost(
    stage_path: Path, tmp_path: Path, odd: str, words: str
) -> None:
    found = run(
        "edit", tmp_path, stage=stage_path, overlay=tmp_path / "edit.usda", lod="lod2",
        representation="both", tiles="r0_c0", odd=[odd],
    )  # fmt: skip
    ((kind, message),) = found["messages"]
    assert kind == "Warning"
    carried, lost = message.split(". Not carried: ")
    assert words in lost
    assert lost.count("; ") == 0, lost
    assert "points" not in carried


def additions_of(bundle: Path) -> dict[str, Any]:
    """Return the meshes of additions.glb by their paths, in um, as trimesh reads them."""
    scene = trimesh.load(bundle / "additions.glb")
    return {
        name: scene.geometry[geometry].copy().apply_transform(matrix).apply_scale(1e6)
        for name in scene.graph.nodes_geometry
        for matrix, geometry in [scene.graph[name]]
    }


@pytest.mark.parametrize("size", ["MICROMETRES", "TRUE"])
def test_objects_that_an_artist_adds_reach_the_bundle(
    stage_path: Path, tmp_path: Path, size: str
) -> None:
    overlay, bundle = tmp_path / "edit.usda", tmp_path / "bundle"
    found = run("edit", tmp_path, stage=stage_path, overlay=overlay, size=size, odd=["decorate"])
    ((kind, message),) = found["messages"]
    assert kind == "Info", message
    assert validate_stage(overlay) == []
    assert [line for line in write(overlay, bundle) if "is not taken over" in line] == []
    manifest = load(bundle / "manifest.json")
    names = [layer["name"] for layer in manifest["additions"]["layers"]]
    assert names == ["arrow: here", "box", "label", "wire"]
    meshes = additions_of(bundle)
    arrow, box, label, wire = (meshes[path] for path in sorted(meshes))
    assert arrow.bounds == pytest.approx(np.array([(8, -5, 20), (12, -1, 20)]), abs=1e-3)
    assert tuple(arrow.visual.material.baseColorFactor) == (255, 128, 0, 128)
    assert arrow.visual.material.metallicFactor == 1
    assert arrow.visual.material.roughnessFactor == pytest.approx(0.25)
    assert box.bounds == pytest.approx(np.array([(37, -7, 3), (43, -3, 5)]), abs=1e-3)
    outwards = np.einsum("ij,ij->i", box.vertex_normals, box.vertices - (40, -5, 4))
    assert (outwards > 0).all()  # although the object is mirrored
    solid = trimesh.Trimesh(box.vertices, box.faces)
    assert solid.volume == pytest.approx(48, rel=1e-3)
    assert label.bounds[0][:2] == pytest.approx([0, 5], abs=0.5)
    assert 5 < label.extents[0] < 12
    assert wire.bounds == pytest.approx(np.array([(1.2, -13.8, 3.2), (18.8, 3.8, 4.8)]), abs=0.05)
    (view,) = manifest["views"]
    assert view["name"] == "Close"
    assert view["position_um"] == pytest.approx([10, -5, 60], abs=1e-3)
    assert view["target_um"][:2] == pytest.approx([10, -5], abs=1e-3)
    assert view["fov_deg"] == pytest.approx(np.degrees(2 * np.arctan(0.2)), abs=1e-3)
    lamps = {lamp["name"]: lamp for lamp in manifest["lights"]["lamps"]}
    assert set(lamps) == {"Bulb", "Evening", "key"}
    assert lamps["Evening"]["towards"] == pytest.approx([1, 0, 0], abs=1e-4)
    assert lamps["Evening"]["color"] == pytest.approx([1, 0.5, 0.25], abs=1e-4)
    assert lamps["Evening"]["strength"] == pytest.approx(2 / np.pi, rel=1e-4)
    assert lamps["Bulb"]["position_um"] == pytest.approx([20, 95, 4], abs=1e-2)
    middle = np.mean([manifest["specimen"]["bounds_um"][end] for end in ("min", "max")], axis=0)
    distance = np.linalg.norm(middle - (20, 95, 4))
    # A surface that faces the lamp receives P / (4 pi d^2); a white one reflects 1 / pi of that.
    assert lamps["Bulb"]["strength"] == pytest.approx(0.5 * (100 / distance) ** 2, rel=1e-3)
    assert lamps["key"]["strength"] == pytest.approx(1 / np.pi, rel=1e-4)
    glb = next((bundle / "channels" / manifest["channels"][0]["id"]).rglob("*.glb"))
    document, _ = read(glb.read_bytes())
    assert document["materials"][0]["alphaMode"] == "BLEND"
    assert document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][3] == pytest.approx(
        0.4
    )


def test_exposure_temperature_and_colors_above_white_reach_the_bundle(
    stage_path: Path, tmp_path: Path
) -> None:
    overlay, bundle = tmp_path / "edit.usda", tmp_path / "bundle"
    found = run("edit", tmp_path, stage=stage_path, overlay=overlay, odd=["shine"])
    assert found["messages"][0][0] == "Info", found["messages"]
    lines = [line for line in write(overlay, bundle) if "is not taken over" in line]
    (lamp,) = [
        one for one in load(bundle / "manifest.json")["lights"]["lamps"] if "Ev" in one["name"]
    ]
    # The sun has 2 W/m2 and an exposure of three stops. Its light is as red as that of a candle.
    red, green, blue = lamp["color"]
    assert red == 1
    assert 0.2 < green < 0.6
    assert blue < 0.15
    plain = 2.0 * 2**3 / np.pi
    assert plain < lamp["strength"] <= 10, lines
    (mesh,) = additions_of(bundle).values()
    assert tuple(mesh.visual.material.baseColorFactor[:3]) == (255, 128, 0)
    assert tuple(mesh.visual.material.emissiveFactor) == pytest.approx((1, 0.25, 0), abs=1e-6)


def test_additions_of_an_earlier_export_are_moved_and_hidden(
    stage_path: Path, tmp_path: Path
) -> None:
    first, second = tmp_path / "first.usda", tmp_path / "second.usda"
    run("edit", tmp_path, stage=stage_path, overlay=first, odd=["decorate"])
    group = "/Specimen/Annotations"
    found = run(
        "edit", tmp_path, stage=first, overlay=second,
        move={f"{group}/box": (5, 0, 0)}, hide=[f"{group}/wire"], delete=[f"{group}/label"],
    )  # fmt: skip
    ((kind, message),) = found["messages"]
    assert kind == "Info", message
    write(second, tmp_path / "bundle")
    names = {one["name"] for one in load(tmp_path / "bundle/manifest.json")["additions"]["layers"]}
    assert names == {"arrow: here", "box"}
    box = additions_of(tmp_path / "bundle")[f"{group}/box"]
    assert box.bounds == pytest.approx(np.array([(42, -7, 3), (48, -3, 5)]), abs=1e-3)


def test_a_copy_of_a_surface_is_an_addition_in_its_color(stage_path: Path, tmp_path: Path) -> None:
    overlay = tmp_path / "edit.usda"
    run("edit", tmp_path, stage=stage_path, overlay=overlay, tiles="r0_c0", odd=["copy"])
    write_bundle(overlay, tmp_path / "bundle", None, engine=Engine(0))
    manifest = load(tmp_path / "bundle" / "manifest.json")
    (layer,) = manifest["additions"]["layers"]
    assert layer["name"] == f"{NAME}.001"
    (mesh,) = additions_of(tmp_path / "bundle").values()
    (channel,) = [one for one in manifest["channels"] if one["id"] == F_ID]
    found = np.array(mesh.visual.material.baseColorFactor[:3]) / 255
    assert found == pytest.approx(channel["color"], abs=1 / 255)


def test_a_picture_shows_mesh_volume_and_the_new_colour(stage_path: Path, tmp_path: Path) -> None:
    picture = tmp_path / "picture.png"
    run(
        "render", tmp_path, stage=stage_path, representation="both", transfer_function="sharp",
        lod="lod0", colors={BALL_ID: [0.05, 0.9, 0.1]}, picture=picture, samples=8,
        pixels=[160, 90],
        hide=[leaf("r0_c0", F_ID), leaf("r0_c0", BALL_ID), leaf("r0_c1", F_ID, "_volume"),
              leaf("r0_c1", BALL_ID, "_volume")],
    )  # fmt: skip
    image = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    red, green, blue = (image[..., k] for k in range(3))
    letter = (red > 1.5 * green) & (red > 1.5 * blue)
    ball = (green > 1.5 * red) & (green > 1.5 * blue)
    left, right = slice(0, 80), slice(80, 160)
    for half in (left, right):  # volumes on the left, meshes on the right
        assert letter[:, half].sum() > 50
        assert ball[:, half].sum() > 50


def test_blenders_importer_opens_an_exported_gltf(stage_path: Path, tmp_path: Path) -> None:
    for packing in (None, "draco"):
        with forcing(True):
            options = ExportOptions(lod=0, compress=packing)
            export_stage(stage_path, tmp_path / "f.glb", options=options)
        found = run("gltf", tmp_path, file=tmp_path / "f.glb")
        assert found["parents"] == {f"{name} {tile}": name for name in NAMES[:2] for tile in TILES}
        for name, color in zip(NAMES[:2], COLORS[:2], strict=True):
            assert found["colors"][name] == pytest.approx([*color, 1], abs=1e-6)
        # The F is 36 voxels of .25 um high, and z is up in Blender.
        low, high = (np.array(end) * 1e6 for end in found["bounds"])
        assert high[2] - low[2] == pytest.approx(36 * 0.25, rel=0.03)

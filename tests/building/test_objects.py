"""Builds of label maps from end to end: tiles of objects, the table, edits, resuming."""

import json
from pathlib import Path

import numpy as np
import pytest
import tifffile
import zarr
from pxr import Sdf, Usd, UsdGeom, Vt

from stereocell import samples
from stereocell.engine.run import Engine
from stereocell.formats.gltf_decode import read_glb
from stereocell.planning import label_numbers
from stereocell.samples.cells import SPACING_UM, make_tissue, table_beside
from support.bundles import write_bundle
from support.digests import digests_of
from support.label_builds import (
    PHASES,
    build,
    column_of,
    labels_of,
    objects_of,
    printed,
    run,
)

SHAPE = (24, 48, 96)


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("a sample's") / "small tissue.ome.zarr"
    samples.write_cells(path, seed=3, shape=SHAPE)
    return path


@pytest.fixture(scope="module")
def out(sample: Path) -> Path:
    """A build of two tiles, one image channel, and a table with errors of three kinds."""
    table = table_beside(sample)
    lines = table.read_text("utf-8").splitlines()
    lines = [lines[0], *lines[2:], "9999,T cell" + ",1" * 12, "8888,B cell" + ",2" * 12]
    lines[3] = lines[3].replace(lines[3].split(",")[2], "nan")
    table.write_text("\n".join(lines) + "\n")
    out = sample.parent / "out"
    build(
        sample,
        out,
        *("--grid", "2x1", "--channels", "CD3"),
        *("--labels", "cells", "--table", table),
    )
    return out


@pytest.mark.slow
def test_each_cell_is_built_once_with_the_volume_of_its_voxels(out: Path) -> None:
    tissue = make_tissue(SHAPE, 3)
    labels, counts = np.unique(tissue.labels[tissue.labels > 0], return_counts=True)
    labels, counts = labels[counts >= 27], counts[counts >= 27]
    found = labels_of(out)
    assert sorted(found.tolist()) == labels.tolist()
    expected = dict(zip(labels.tolist(), counts * np.prod(SPACING_UM), strict=True))
    volumes = column_of(out, "volume_um3")
    assert volumes == pytest.approx([expected[label] for label in found.tolist()])
    for axis, letter in enumerate("zyx"):
        places = column_of(out, f"centroid_{letter}_um")
        for label, place in zip(found.tolist(), places, strict=True):
            at = np.argwhere(tissue.labels == label)[:, axis].mean() * SPACING_UM[axis]
            assert place == pytest.approx(at, abs=1e-3)


@pytest.mark.slow
def test_a_cell_lies_in_the_tile_of_its_centroid(out: Path) -> None:
    tiles = objects_of(out)["tiles"]
    assert sorted(tiles) == ["r0_c0", "r0_c1"]
    x_um = column_of(out, "centroid_x_um")
    middle = 47.5 * SPACING_UM[2]  # between two voxels
    for tile, is_left in (("r0_c0", True), ("r0_c1", False)):
        first, count = tiles[tile]["first"], tiles[tile]["count"]
        assert count > 5
        assert ((x_um[first : first + count] < middle) == is_left).all()


def test_the_image_is_measured_over_each_cell(out: Path, sample: Path) -> None:
    tissue = make_tissue(SHAPE, 3)
    voxels = np.asarray(zarr.open_group(sample, mode="r")["0"][3])  # CD3
    means, p95s = column_of(out, "mean_CD3"), column_of(out, "p95_CD3")
    for row, label in enumerate(labels_of(out).tolist()):
        own = voxels[tissue.labels == label]
        assert means[row] == pytest.approx(own.mean(), rel=1e-5)
        assert p95s[row] == pytest.approx(np.percentile(own, 95), rel=1e-5)


def test_the_table_is_joined_by_label_and_rows_that_do_not_fit_are_reported(
    out: Path, sample: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (out / "phases.json").unlink()
    assert run("stage", out, "--workers", 0) == 0
    output = printed(capsys)
    assert "2 rows without an object: CellID 8888, 9999" in output
    assert "1 object without a row: 1" in output
    tissue = make_tissue(SHAPE, 3)
    kinds = objects_of(out)
    entry = next(one for one in kinds["columns"] if one["id"] == "cell_type")
    assert kinds["default"] == "cell_type"
    codes = column_of(out, "cell_type")
    for row, label in enumerate(labels_of(out).tolist()):
        name = "" if codes[row] < 0 else entry["categories"][int(codes[row])]
        truth = ("tumour", "T cell", "B cell", "macrophage")[tissue.types[label - 1]]
        assert name == ("" if label == 1 else truth)
    assert np.isnan(column_of(out, "CD8")[labels_of(out) == 1]).all()


@pytest.mark.slow
def test_a_stage_with_classes_is_valid(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stage = Usd.Stage.Open(str(out / "stage/stage.usda"))
    classes = stage.GetPrimAtPath("/Specimen/Classes/cells").GetChildren()
    assert [one.GetName() for one in classes][:2] == ["class_B_x20_cell", "class_T_x20_cell"]
    assert run("check", out, "--deep", "--workers", 0) == 0, printed(capsys)


@pytest.mark.slow
def test_classes_of_other_names_reach_the_bundle(out: Path, tmp_path: Path) -> None:
    layer = Sdf.Layer.CreateNew(str(out / "stage/names.usda"))
    layer.subLayerPaths = ["./stage.usda"]
    stage = Usd.Stage.Open(layer)
    kinds = stage.GetPropertyAtPath("/Specimen/Channels/cells.stereocell:column:cell_type")
    names = [f"{name}, it's" for name in kinds.GetCustomDataByKey("categories")]
    kinds.SetCustomDataByKey("categories", Vt.StringArray(names))
    layer.Save()
    write_bundle(out / "stage/names.usda", tmp_path / "bundle", None, engine=Engine(0))
    content = objects_of(tmp_path)
    (column,) = (one for one in content["columns"] if one["id"] == "cell_type")
    assert column["categories"] == names
    assert len(column["colors"]) == len(names)


def test_each_level_of_detail_in_a_file_names_its_cells(out: Path) -> None:
    content = objects_of(out)
    boxes = np.fromfile(out / "bundle" / content["boxes"]["path"], "<f4").reshape(-1, 6)
    manifest = json.loads((out / "bundle/manifest.json").read_text("utf-8"))
    (channel,) = (one for one in manifest["channels"] if one["id"] == "cells")
    farthest = 2 * channel["distances"][-1]["largest_um"]
    for tile, rows in content["tiles"].items():
        for file in sorted((out / "bundle/channels/cells" / tile).glob("*.glb")):
            mesh = read_glb(file)
            ids = mesh.objects
            assert sorted(set(ids.tolist())) == list(range(rows["count"]))
            um = mesh.positions_m * 1e6
            for number in range(rows["count"]):
                low, high = um[ids == number].min(axis=0), um[ids == number].max(axis=0)
                box = boxes[rows["first"] + number]
                assert (low > box[:3] - farthest).all()
                assert (high < box[3:] + farthest).all()


@pytest.mark.slow
def test_no_work_is_repeated_and_a_table_changes_only_the_stage(
    out: Path, sample: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for phase in PHASES[1:]:
        assert run(phase, out, "--workers", 0) == 0
    printed(capsys)
    for phase in PHASES[1:]:
        assert run(phase, out, "--workers", 0) == 0
        assert f"{phase}: up to date" in printed(capsys)
    before = digests_of(out / "units")
    other = sample.parent / "other.csv"
    other.write_text("label,score\n2,0.5\n3,0.25\n")
    assert run(
        *("plan", sample, "-o", out, "--grid", "2x1", "--channels", "CD3"),
        *("--labels", "cells", "--table", other),
    ) == 0  # fmt: skip
    assert run("units", out, "--workers", 0) == 0
    units = {name for name in digests_of(out / "units") if "volume" in name or "lod" in name}
    assert all(digests_of(out / "units")[name] == before[name] for name in units)
    assert run("stage", out, "--workers", 0) == 0
    assert "objects without a row" in printed(capsys)
    assert run("bundle", out, "--workers", 0) == 0
    scores = dict(zip(labels_of(out).tolist(), column_of(out, "score"), strict=True))
    assert scores[2] == 0.5
    assert np.isnan(scores[5])


@pytest.mark.slow
def test_edits_of_the_stage_reach_the_bundle(out: Path) -> None:
    """An artist's layer overrides a value and a colour."""
    stage = Usd.Stage.Open(str(out / "stage/stage.usda"))
    path = "/Specimen/Tiles/r0_c0/cells/cells_r0_c0"
    layer = Sdf.Layer.CreateNew(str(out / "stage/edit.usda"))
    layer.subLayerPaths = ["./stage.usda"]
    edited = Usd.Stage.Open(layer)
    mesh = UsdGeom.Mesh(edited.GetPrimAtPath(path))
    primvars = UsdGeom.PrimvarsAPI(mesh)
    volumes = np.array(primvars.GetPrimvar("volume_um3").Get())
    volumes[0] = 12345
    primvars.GetPrimvar("volume_um3").Set(Vt.FloatArray.FromNumpy(volumes))
    colors = np.array(primvars.GetPrimvar("displayColor").Get())
    colors[0] = (0.0, 0.0, 1.0)
    primvars.GetPrimvar("displayColor").Set(Vt.Vec3fArray.FromNumpy(colors))
    # hidden objects, another column that colours, and a class of another name
    all_labels = [*mesh.GetPrim().GetAttribute("stereocell:objectLabels").Get()]
    hidden = all_labels[1:3]
    channel = edited.GetPrimAtPath("/Specimen/Channels/cells")
    attribute = channel.CreateAttribute("stereocell:hiddenObjects", Sdf.ValueTypeNames.UInt64Array)
    attribute.Set(Vt.UInt64Array([*hidden, 10**15]))
    channel.GetAttribute("stereocell:defaultColumn").Set("volume_um3")
    layer.Save()
    before = labels_of(out).tolist()
    neighbours = np.fromfile(out / "bundle" / objects_of(out)["neighbours"]["rows"]["path"], "<u4")
    del stage, edited
    assert run("bundle", out, "--stage", out / "stage/edit.usda", "--workers", 0) == 0
    assert labels_of(out).tolist() == [label for label in before if label not in hidden]
    content = objects_of(out)
    fewer = np.fromfile(out / "bundle" / content["neighbours"]["rows"]["path"], "<u4")
    assert len(fewer) < len(neighbours)
    assert content["default"] == "volume_um3"
    for level in range(4):
        drawn = read_glb(out / f"bundle/channels/cells/r0_c0/lod{level}.glb")
        assert sorted(set(drawn.objects.tolist())) == list(range(len(all_labels) - 2))
    assert column_of(out, "volume_um3")[0] == 12345
    mesh = read_glb(out / "bundle/channels/cells/r0_c0/lod1.glb")
    ids = mesh.objects
    shown = mesh.colors
    assert (shown[ids == 0] == (0, 0, 1)).all()
    assert not (shown[ids == 1] == (0, 0, 1)).all()


@pytest.mark.exhaustive
@pytest.mark.parametrize("workers", [1, 2])
def test_any_number_of_workers_gives_the_same_bytes(
    out: Path, tmp_path: Path, workers: int
) -> None:
    labels = make_tissue(SHAPE, 3).labels.astype(np.uint16)
    source = tmp_path / "mask.ome.tif"
    tifffile.imwrite(source, labels, metadata={"axes": "ZYX"})
    made = []
    for count in (0, workers):
        place = tmp_path / f"out{count}"
        flags = ("--labels", "cells=.", "--spacing-um", "1,0.5,0.5", "--tile-size", "24,40,40")
        assert run("plan", source, "-o", place, *flags) == 0
        for phase in PHASES[1:]:
            assert run(phase, place, "--workers", count) == 0
        made.append(digests_of(place / "bundle"))
    assert made[0] == made[1]


def refusal(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    assert run(*arguments) in (1, 2)
    output = capsys.readouterr().err.strip().splitlines()
    assert len(output) == 1
    return output[0]


def test_label_maps_and_flags_that_do_not_fit_are_refused_in_one_line(
    sample: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plan = ("plan", sample, "-o", tmp_path / "out", "--channels", "DNA")
    output = refusal(capsys, *plan, "--labels", "nuclei")
    assert "--labels nuclei" in output
    assert "--labels nuclei=PATH" in output
    output = refusal(capsys, *plan, "--labels", "DNA=" + str(sample / "labels/cells"))
    assert "a channel has this name already" in output
    assert "expected another name, such as DNA_objects=PATH" in output
    tifffile.imwrite(tmp_path / "m.tif", np.ones((6, 5, 7), np.uint8), metadata={"axes": "ZYX"})
    output = refusal(capsys, *plan, "--labels", f"m={tmp_path / 'm.tif'}")
    assert "states no voxel size: found 6 x 5 x 7 voxels (z, y, x), expected the image's" in output
    negative = np.zeros((6, 8, 300), np.int16)
    negative[..., -1] = -7  # far from its middle
    tifffile.imwrite(tmp_path / "n.tif", negative, metadata={"axes": "ZYX"})
    flags = ("--labels", ".", "--spacing-um", "1,1,1")
    output = refusal(capsys, "plan", tmp_path / "n.tif", "-o", tmp_path / "n", *flags)
    assert "found -7, expected labels of 0 or more" in output
    assert not (tmp_path / "n").exists()
    monkeypatch.setattr(
        label_numbers, "_COUNTED_AT_ONCE", 100
    )  # makes the label map count as too large to be counted
    assert run("plan", tmp_path / "n.tif", "-o", tmp_path / "n", *flags) == 0
    assert run("units", tmp_path / "n", "--workers", 0) == 1
    assert "found -7, expected labels of 0 or more" in capsys.readouterr().err
    for flag in ("--table", "--table-key", "--columns", "--color-by"):
        assert f"{flag} is 'a', expected --labels with it" in refusal(capsys, *plan, flag, "a")
    output = refusal(capsys, *plan, "--labels", "cells", "--columns", "a,b")
    assert "--columns is 'a,b', expected --table with it" in output
    output = refusal(capsys, *plan, "--labels", "cells", "--table", tmp_path / "none.csv")
    assert "none.csv: can't be read" in output
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_the_table_belongs_to_the_first_of_two_label_maps(
    sample: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    again, table = sample / "labels/cells", tmp_path / "t.csv"
    table.write_text("label,score\n2,0.5\n")
    flags = ("--channels", "DNA", "--labels", "cells", "--table", table)
    for more, is_reported in ((), False), (("--labels", f"again={again}"), True):
        assert run("plan", sample, "-o", tmp_path / "out", *flags, *more) == 0
        assert (
            "the table is joined only to the first label map, cells" in printed(capsys)
        ) is is_reported
    out, flags = tmp_path / "small", (*flags, *more, "--color-by", "score", "--grid", "2x1")
    build(sample, out, *flags)
    assert objects_of(out)["default"] == "score"
    assert objects_of(out, "again")["default"] != "score"
    printed(capsys)
    output = refusal(capsys, "plan", sample, "-o", tmp_path / "o", *flags, "--color-by", "scores")
    assert "--color-by is 'scores', expected one of volume, area, " in output
    assert output.endswith(", score")


@pytest.mark.slow
def test_tiles_fit_labels_of_another_spacing_and_place(sample: Path, tmp_path: Path) -> None:
    """The labels have half the image's resolution, and their file states another place."""
    tissue = make_tissue(SHAPE, 3)
    coarse = tissue.labels[::2, ::2, ::2]
    place = tmp_path / "coarse.ome.zarr"
    group = zarr.open_group(place, mode="w", zarr_format=3)
    spacing = [2 * s for s in SPACING_UM]
    group.attrs["ome"] = {
        "version": "0.5",
        "image-label": {
            "colors": [{"label-value": 1, "rgba": [0, 0, 255, 255]}],
            "properties": [
                {"label-value": number, "side": "left" if number % 2 else "right"}
                for number in range(1, 40)
            ],
        },
        "multiscales": [
            {
                "axes": [
                    {"name": n, "type": "space", "unit": "micrometer"} for n in ("z", "y", "x")
                ],
                "datasets": [
                    {
                        "path": "0",
                        "coordinateTransformations": [
                            {"type": "scale", "scale": spacing},
                            {"type": "translation", "translation": [0.0, 0.0, 0.0]},
                        ],
                    }
                ],
            }
        ],
    }
    group.create_array("0", shape=coarse.shape, dtype="uint32")[...] = coarse
    out = tmp_path / "out"
    flags = ("--grid", "2x1", "--channels", "CD3", "--labels", f"cells={place}")
    build(sample, out, *flags)
    found, volumes = labels_of(out).tolist(), column_of(out, "volume_um3")
    for label, volume in zip(found, volumes, strict=True):
        assert volume == pytest.approx((coarse == label).sum() * np.prod(spacing))
    voxels = np.asarray(zarr.open_group(sample, mode="r")["0"][3])[::2, ::2, ::2]
    for label, mean in zip(found, column_of(out, "mean_CD3"), strict=True):
        assert mean == pytest.approx(voxels[coarse == label].mean(), rel=1e-5)
    # one object has the file's own colour; all others have hues and not colours of categories
    assert any(column["id"] == "side" for column in objects_of(out)["columns"])
    for tile, rows in objects_of(out)["tiles"].items():
        mesh = read_glb(out / f"bundle/channels/cells/{tile}/lod1.glb")
        own = np.array(found[rows["first"] : rows["first"] + rows["count"]])[mesh.objects]
        assert ((mesh.colors == (0, 0, 1)).all(axis=1) == (own == 1)).all()
    assert 1 in found


@pytest.mark.slow
def test_columns_named_like_primvars_are_renamed_and_paths_are_not_recorded(
    sample: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The table has columns named like values of a mesh, and its folder names a patient."""
    folder = tmp_path / "Doe, Jane's"
    folder.mkdir()
    masks, table, out = folder / "masks.tif", folder / "jane.csv", tmp_path / "out"
    labels = make_tissue(SHAPE, 3).labels
    tifffile.imwrite(masks, labels.astype(np.uint16), metadata={"axes": "ZYX"})
    table.write_text("label,normals,st,points,type\n2,1,2,3,\n3,4,5,6,\n")
    flags = ("--channels", "CD3", "--labels", f"cells={masks}", "--table", table)
    build(sample, out, *flags, "--grid", "2x1")
    ids = [one["id"] for one in objects_of(out)["columns"]]
    assert ids[-4:] == ["normals_2", "st_2", "points_2", "type"]
    values = dict(zip(labels_of(out).tolist(), column_of(out, "st_2"), strict=True))
    assert (values[2], values[3]) == (2, 5)
    assert np.isnan(column_of(out, "type")).all()  # no object has a value
    assert run("check", out, "--deep", "--workers", 0) == 0
    for part in ("stage", "bundle"):
        for file in (out / part).rglob("*"):
            held = file.read_bytes() if file.is_file() else b""
            assert b"jane" not in held.lower(), file

    # finished results do not need the masks any more
    masks.unlink()
    printed(capsys)
    for phase in PHASES[1:]:
        assert run(phase, out, "--workers", 0) == 0
        assert f"{phase}: up to date" in printed(capsys)

"""Objects that are cut, thin, painted or measured, in builds of label maps of their own."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import tifffile
from pxr import Usd, UsdGeom

from stereocell.building.out_folder import OutFolder
from stereocell.building.passes import Passes
from stereocell.engine.run import Engine
from stereocell.formats.gltf_decode import read_glb
from stereocell.planning import label_numbers
from stereocell.planning.located_objects import CUT
from stereocell.steps.unit_files import load_objects
from support.dicom_segmentations import SPACING, write_segmentation
from support.dicom_series import grid
from support.dicom_series import sample as scene_on
from support.exhaustive import sweep
from support.label_builds import (
    boxes,
    build,
    column_of,
    labels_of,
    objects_of,
    printed,
    run,
)
from support.phantoms import write_ome_tiff


@pytest.mark.slow
def test_a_large_object_is_cut_at_tile_borders_and_stays_one_object(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    z, y, _x = np.mgrid[:20, :40, :120]
    labels = ((y - 20) ** 2 + (z - 10) ** 2 < 64).astype(np.uint8) * 5  # a rod through all tiles
    labels[2:6, 2:8, 50:58] = 9
    source, out = tmp_path / "rod.tif", tmp_path / "out"
    tifffile.imwrite(source, labels, metadata={"axes": "ZYX"})
    flags = ("--labels", "organs=.", "--spacing-um", "1,1,1", "--tile-size", "20,40,40")
    build(source, out, *flags)
    output = printed(capsys)
    words = "2 objects, 1 of them cut at tile borders, because they reach farther than half a tile"
    assert f"plan: organs: {words}" in output
    assert f"units: organs: {words}" in output
    # for a label map with more voxels the plan states the limit without reading it
    monkeypatch.setattr(label_numbers, "_COUNTED_AT_ONCE", 1000)
    assert run("plan", source, "-o", tmp_path / "other", *flags) == 0
    words = "(z, y, x), the tile and what is read around it, are cut at tile borders"
    assert words in printed(capsys)
    folder = out / "bundle/channels/organs"
    content = objects_of(out, "organs")
    assert content["count"] == 2
    row = labels_of(out, "organs").tolist().index(5)
    assert row == 1  # cut objects come last
    held = [
        [*range(tile["first"], tile["first"] + tile["count"]), *tile.get("more", [])]
        for tile in content["tiles"].values()
    ]
    assert [row in rows for rows in held] == [True, True, True]
    volume = column_of(out, "volume_um3", "organs")[row]
    assert volume == (labels == 5).sum()
    area = column_of(out, "area_um2", "organs")[row]
    radius = np.sqrt(volume / 120 / np.pi)
    # there are no caps inside
    assert area == pytest.approx(2 * np.pi * radius * (radius + 120), rel=0.05)
    # the pieces meet: one ends with the plane with which the next begins
    ends = []
    for tile in ("r0_c0", "r0_c1", "r0_c2"):
        mesh = read_glb(folder / tile / "lod0.glb")
        ids = mesh.objects
        place = max(ids)  # pieces are numbered after whole objects
        ends.append(np.round(mesh.positions_m[ids == place] * 1e6, 3))
    for (left, right), at in zip(pairwise(ends), (39.5, 79.5), strict=True):
        shared = set(map(tuple, left.tolist())) & set(map(tuple, right.tolist()))
        assert len(shared) > 100
        assert np.mean([one[0] for one in shared]) == pytest.approx(at, abs=0.3)


@pytest.mark.slow
def test_a_cut_object_has_the_percentile_of_all_its_voxels(tmp_path: Path) -> None:
    labels = boxes((7, 2, 88), shape=(16, 24, 90))
    rng = np.random.default_rng(3)
    image = (1000 * rng.gamma(2.0, 1 + np.arange(90) / 20, labels.shape)).astype(np.uint16)
    tifffile.imwrite(tmp_path / "l.tif", labels, photometric="minisblack")
    write_ome_tiff(tmp_path / "i.ome.tif", image, names=["DNA"])
    out = tmp_path / "out"
    build(tmp_path / "i.ome.tif", out, "--labels", f"cells={tmp_path / 'l.tif'}", "--grid", "3x1")
    own = image[labels == 7]
    assert len({len(tile.get("more", [])) for tile in objects_of(out)["tiles"].values()}) == 1
    assert column_of(out, "mean_DNA") == pytest.approx([own.mean()], rel=1e-5)
    # rank is right within a thousandth of the voxels
    low, high = np.percentile(own, [94.9, 95.1])
    assert low <= column_of(out, "p95_DNA")[0] <= high


def test_small_objects_are_counted_and_large_ones_end_at_the_region(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    labels = np.zeros((12, 40, 40), np.int64)
    labels[2:8, 2:10, 2:10] = 2**62
    labels[2:8, 2:10, 28:38] = 4
    labels[2:8, 20:28, 14:26] = 6
    labels[5, 30, 5:9] = 3
    labels[9, :3, :] = -1
    source, out = tmp_path / "l.tif", tmp_path / "out"
    tifffile.imwrite(source, labels, metadata={"axes": "ZYX"})
    flags = ("--labels", ".", "--spacing-um", "1,1,1", "--region", "0:12,0:40,0:20")
    assert run("plan", source, "-o", out, *flags) == 0
    assert run("units", out, "--workers", 0) == 0
    output = printed(capsys)
    assert "l: 2 objects; 1 with too few voxels are left out" in output
    plan = OutFolder(out).plan()
    located = Passes(OutFolder(out), plan, Engine(0)).objects(plan.labels[0])
    assert located.extents.labels.tolist() == [6, 2**62]
    facts = load_objects(next(one for one in (out / "units/r0_c0/l").iterdir() if one.is_dir()))
    assert facts.voxels.tolist() == located.extents.voxels.tolist() == [6 * 8 * 6, 6 * 8 * 8]
    assert CUT not in located.owners.tolist()


@pytest.mark.slow
@pytest.mark.parametrize("omit_empty", sweep([False, True], kept=[True]))
def test_a_segmentation_lies_on_its_images(tmp_path: Path, omit_empty: bool) -> None:
    """Two organs with DICOM's own numbers; their first planes are left out or not."""
    voxels = np.zeros((12, 16, 14, 2), np.uint8)
    voxels[4:10, 2:7, 3:11, 0] = 1
    voxels[5:10, 9:14, 3:8, 1] = 1
    path = write_segmentation(tmp_path, "BINARY", voxels, omit_empty=omit_empty)
    out = tmp_path / "out"
    build(tmp_path / "images", out, "--labels", f"organs={path}")
    labels = labels_of(out, "organs").tolist()
    order = [labels.index(number) for number in (1, 2)]
    voxel = float(np.prod(SPACING)) * 1e9
    assert column_of(out, "volume_um3", "organs")[order] == pytest.approx(
        [240 * voxel, 125 * voxel], rel=1e-6
    )
    ids = [one["id"] for one in objects_of(out, "organs")["columns"]]
    means = next(name for name in ids if name.startswith("mean"))
    affine = grid(shape=voxels.shape[:3], spacing=SPACING)
    image = np.rint(scene_on(affine, voxels.shape[:3]))
    expected = [image[voxels[..., i] > 0].mean() for i in (0, 1)]
    assert column_of(out, means, "organs")[order] == pytest.approx(expected, rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("grid", sweep(["1x1", "2x1"], kept=["2x1"]))
def test_the_area_of_each_interface_is_known_for_both_objects(tmp_path: Path, grid: str) -> None:
    """Three boxes in a row touch in 10 x 16 and 10 x 8 voxels of .5 x .2 um; the last is cut."""
    labels = np.zeros((16, 24, 80), np.uint16)
    labels[3:13, 4:20, 4:20], labels[3:13, 4:20, 20:28], labels[3:13, 8:16, 28:76] = 3, 5, 8
    write_ome_tiff(tmp_path / "cells.ome.tif", labels)
    out = tmp_path / "out"
    build(tmp_path / "cells.ome.tif", out, "--labels", ".", "--grid", grid)
    known = objects_of(out)["neighbours"]
    first, rows = (np.fromfile(out / "bundle" / known[k]["path"], "<u4") for k in ("first", "rows"))
    areas = np.fromfile(out / "bundle" / known["area_um2"]["path"], "<f4")
    names = labels_of(out)
    found = {
        (int(names[row]), int(names[other])): float(area)
        for row in range(3)
        for other, area in zip(
            rows[first[row] : first[row + 1]], areas[first[row] : first[row + 1]], strict=True
        )
    }
    assert set(found) == {(3, 5), (5, 3), (5, 8), (8, 5)}
    for one, other, area in ((3, 5, 160), (5, 8, 80)):
        assert found[one, other] == found[other, one] == pytest.approx(0.1 * area, rel=0.05)


@pytest.mark.slow
def test_labels_are_read_without_a_cast(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    labels = np.zeros((12, 16, 16), np.uint32)
    labels[3:9, 4:12, 4:12] = 2**31 + 1
    write_ome_tiff(tmp_path / "cells.ome.tif", labels)
    build(tmp_path / "cells.ome.tif", tmp_path / "out", "--labels", ".")
    assert "rounded" not in printed(capsys)
    assert labels_of(tmp_path / "out").tolist() == [2**31 + 1]


@pytest.mark.slow
def test_a_stain_is_painted_on_the_objects(tmp_path: Path) -> None:
    """The first of two boxes lies in the dark, the second in stained tissue."""
    labels = np.zeros((20, 24, 48), np.uint16)
    labels[4:16, 4:20, 4:20], labels[4:16, 4:20, 28:44] = 5, 9
    z, y, x = np.indices(labels.shape) - np.array([9.5, 11.5, 35.5]).reshape(3, 1, 1, 1)
    image = 1000 * ((z / 14) ** 2 + (y / 18) ** 2 + (x / 13) ** 2 < 1)
    tifffile.imwrite(tmp_path / "l.tif", labels, photometric="minisblack")
    write_ome_tiff(tmp_path / "i.ome.tif", image.astype(np.uint16), names=["DNA"])
    out = tmp_path / "out"
    flags = ("--labels", f"cells={tmp_path / 'l.tif'}", "--paint", "cells=DNA", "--grid", "2x1")
    build(tmp_path / "i.ome.tif", out, *flags)
    assert objects_of(out)["paint"] == "DNA"
    for tile, expected in (("r0_c0", 0.0), ("r0_c1", 1.0)):
        for file in (out / "bundle/channels/cells" / tile).glob("*.glb"):
            paint = read_glb(file).paint
            assert paint is not None
            np.testing.assert_allclose(paint, expected, atol=0.02)
    stage = Usd.Stage.Open(str(out / "stage/stage.usda"))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Specimen/Tiles/r0_c1/cells/cells_r0_c1"))
    paint = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("paint")
    assert (paint.GetInterpolation(), len(paint.Get())) == (
        "vertex",
        len(mesh.GetPointsAttr().Get()),
    )
    assert min(paint.Get()) > 0.98
    assert run("check", out, "--deep", "--workers", 0) == 0
    assert run("plan", tmp_path / "i.ome.tif", "-o", tmp_path / "o", *flags[:3], "cells=CD9") == 2
    alone = ("--labels", ".", "--spacing-um", "1,1,1", "--paint", "labels=DNA")
    assert run("plan", tmp_path / "l.tif", "-o", tmp_path / "o", *alone) == 2


@pytest.mark.slow
@pytest.mark.parametrize("is_alone", [False, True])
def test_objects_that_are_too_thin_are_reported_and_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], is_alone: bool
) -> None:
    """Object 700 is noise, which a build leaves out.

    The label map holds it beside a cell, or alone; then the build has no object.
    """
    labels = np.zeros((16, 40, 40), np.uint16)
    rng = np.random.default_rng(1)
    labels[:, :, 20:] = rng.integers(0, 2, (16, 40, 20)) * 700
    if not is_alone:
        labels[3:12, 5:15, 5:15] = 12
    source, out = tmp_path / "noise.tif", tmp_path / "out"
    tifffile.imwrite(source, labels, metadata={"axes": "ZYX"})
    build(source, out, "--labels", "cells=.", "--spacing-um", "1,1,1")
    output = printed(capsys)
    assert "cells: 1 object left out, too thin to be built, or full of holes: 700" in output
    assert run("report", out) == 0
    assert run("check", out, "--deep", "--workers", 0) == 0
    if is_alone:
        assert not (out / "bundle/channels/cells/objects.json").exists()
    else:
        assert labels_of(out).tolist() == [12]


@pytest.mark.slow
def test_more_objects_than_a_file_can_number_need_more_tiles(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    edges = (120, 120, 132)  # 40 x 40 x 44 cubes of 27 voxels
    z, y, x = (index // 3 for index in np.indices(edges, np.uint32))
    mask, wide = tmp_path / "many.ome.tif", ["--labels", ".", "--spacing-um", "1,1,1"]
    tifffile.imwrite(mask, (z * 40 + y) * 44 + x + 1, metadata={"axes": "ZYX"})
    assert run("plan", mask, "-o", tmp_path / "one", *wide, "--grid", "1x1") == 2
    printed = capsys.readouterr().err
    assert "found 70,400 objects in tile r0_c0, expected at most 65,536" in printed
    assert "--grid" in printed
    assert run("plan", mask, "-o", tmp_path / "two", *wide, "--grid", "2x1") == 0

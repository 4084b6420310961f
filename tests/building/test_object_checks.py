"""Faults of built label maps that the report and the deep check find."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from pxr import Sdf, Usd, UsdGeom, Vt

from stereocell.objects import build_objects as building
from stereocell.objects.build_objects import BuiltObjects
from stereocell.objects.intensities import Intensities
from stereocell.objects.interfaces import Interfaces
from stereocell.samples.cells import make_tissue
from stereocell.steps import build_objects as objects_maker
from support.exhaustive import sweep
from support.label_builds import boxes, build, labels_of, objects_of, run, said
from support.phantoms import write_ome_tiff

SHAPE = (24, 48, 96)


@pytest.mark.slow
def test_the_report_and_the_deep_check_describe_objects(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    labels = make_tissue(SHAPE, 3).labels
    source, out = tmp_path / "mask.tif", tmp_path / "out"
    tifffile.imwrite(source, labels.astype(np.uint16), metadata={"axes": "ZYX"})
    build(source, out, "--labels", "cells=.", "--spacing-um", "1,0.5,0.5", "--grid", "2x1")
    count = len(labels_of(out))
    assert run("report", out) == 0
    page = (out / "report/index.html").read_text("utf-8")
    assert f"cells: {count} objects</h3>" in page
    said(capsys)
    assert run("check", out, "--deep", "--workers", 0) == 0
    output = said(capsys)
    assert f"ok   cells against source: {count} objects" in output
    assert "ok   bundle against stage: 8 surfaces" in output

    # a label that was not counted in one tile and level, and a surface that is too small
    layer = Sdf.Layer.FindOrOpen(str(out / "stage/tiles/r0_c0/tile.usdc"))
    stage = Usd.Stage.Open(layer)
    stage.GetDefaultPrim().GetVariantSet("lod").SetVariantSelection("lod0")
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/r0_c0/cells/cells_r0_c0"))
    with stage.GetDefaultPrim().GetVariantSet("lod").GetVariantEditContext():
        areas = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("area_um2")
        areas.Set(Vt.FloatArray([2.0, *list(areas.Get())[1:]]))
    layer.Save()
    assert run("check", out, "--deep", "--workers", 0) == 1
    first = labels_of(out)[objects_of(out)["tiles"]["r0_c0"]["first"]]
    line = "FAIL cells against source: r0_c0/cells: column area_um2 differs from the table"
    assert f"{line} for the objects {first}" in said(capsys)


@pytest.mark.slow
def test_levels_whose_simplification_stops_early_are_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_ome_tiff(tmp_path / "l.ome.tif", boxes((3, 4, 20), shape=(16, 24, 24)))
    right = building.simplify_interfaces

    def simplify_interfaces(walls: Interfaces, error: float, *given: Any, **named: Any) -> Any:
        return (walls, False) if error > 0.2 else right(walls, error, *given, **named)

    monkeypatch.setattr(building, "simplify_interfaces", simplify_interfaces)
    build(tmp_path / "l.ome.tif", tmp_path / "out", "--labels", ".")
    wanted = "l: simplifying lod3 stopped early in r0_c0, because triangles would have crossed"
    output = said(capsys)
    assert wanted in output
    assert "lod2 has" not in output
    assert run("report", tmp_path / "out") == 0
    assert wanted in (tmp_path / "out/report/index.html").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("measure_of", sweep(["mean", "p95"], kept=["p95"]))
def test_the_deep_check_measures_the_image_again(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    measure_of: str,
) -> None:
    """The unit measured wrongly, and the stage has its values instead of the voxels' true ones."""
    labels = boxes((3, 4, 20), (5, 24, 36), (8, 40, 56), shape=(16, 24, 60))
    image = np.random.default_rng(3).poisson(300, labels.shape).astype(np.uint16)
    tifffile.imwrite(tmp_path / "l.tif", labels, photometric="minisblack")
    write_ome_tiff(tmp_path / "i.ome.tif", image, names=["DNA"])
    flags = ("--labels", f"cells={tmp_path / 'l.tif'}", "--grid", "2x1")
    build(tmp_path / "i.ome.tif", tmp_path / "right", *flags)
    assert run("check", tmp_path / "right", "--deep", "--workers", 0) == 0
    right = objects_maker.measure_intensities

    def measure(*given: Any, **named: Any) -> Intensities:
        found = right(*given, **named)
        getattr(found, measure_of)[-1] += 30
        return found

    monkeypatch.setattr(objects_maker, "measure_intensities", measure)
    build(tmp_path / "i.ome.tif", tmp_path / "wrong", *flags)
    said(capsys)
    assert run("check", tmp_path / "wrong", "--deep", "--workers", 0) == 1
    output = said(capsys)  # on the last object of each tile
    assert f"cells: column {measure_of}_DNA differs from the voxels' {measure_of} of 3, 8" in output
    assert output.count("voxels'") == 1


@pytest.mark.slow
def test_the_deep_check_measures_the_surfaces_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_ome_tiff(tmp_path / "l.ome.tif", boxes((3, 4, 20), shape=(16, 24, 24)))
    right = objects_maker.build_objects

    def build_objects(*given: Any, **named: Any) -> BuiltObjects:
        built = right(*given, **named)
        return replace(built, areas_um2=1.1 * built.areas_um2)

    monkeypatch.setattr(objects_maker, "build_objects", build_objects)
    build(tmp_path / "l.ome.tif", tmp_path / "wrong", "--labels", ".")
    said(capsys)
    assert run("check", tmp_path / "wrong", "--deep", "--workers", 0) == 1
    assert "column area_um2 differs from the surfaces of the objects 3" in said(capsys)


@pytest.mark.slow
@pytest.mark.parametrize(
    "fault",
    sweep(
        ["none", "a wall too many", "a wall that is missing", "smaller"],
        kept=["a wall too many", "a wall that is missing", "smaller"],
    ),
)
@pytest.mark.parametrize("grid", sweep(["1x1", "2x1"], kept=["2x1"]))
def test_the_deep_check_measures_the_interfaces_again(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    grid: str,
    fault: str,
) -> None:
    """Two boxes touch, in one tile or at the plane between two tiles, and one box is apart."""
    labels = boxes((3, 22, 36), (5, 36, 50), (8, 54, 66), shape=(16, 24, 72))
    write_ome_tiff(tmp_path / "l.ome.tif", labels)
    right = objects_maker.build_objects

    def build_objects(labels: np.ndarray, owned: np.ndarray, **named: Any) -> BuiltObjects:
        built = right(labels, owned, **named)
        walls, areas = built.walls, built.wall_um2
        if fault == "a wall too many":
            walls = np.concatenate([walls, [[0, walls[0, 1] + 1]]]).astype(np.int32)
            areas = np.append(areas, 0.01)
        elif fault == "a wall that is missing":
            walls, areas = walls[1:], areas[1:]
        elif fault == "smaller":
            areas = 0.7 * areas
        return replace(built, walls=walls, wall_um2=areas)

    monkeypatch.setattr(objects_maker, "build_objects", build_objects)
    build(tmp_path / "l.ome.tif", tmp_path / "out", "--labels", ".", "--grid", grid)
    said(capsys)
    assert run("check", tmp_path / "out", "--deep", "--workers", 0) == (fault != "none")
    output = said(capsys)
    odd = {
        column
        for column in ("neighbours", "contact")
        if f"column {column} differs from the surfaces of" in output
    }
    assert (
        odd
        == {
            "none": set(),
            "a wall too many": {"neighbours"},
            "a wall that is missing": {"neighbours", "contact"},
            "smaller": {"contact"},
        }[fault]
    )

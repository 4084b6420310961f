"""A layer over the stage with no or other units is reported, with the lines to write."""

from pathlib import Path

import pytest
from pxr import Usd

from stereocell.engine.run import Engine
from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.model.errors import StageError
from stereocell.usd.layer_units import note_missing
from stereocell.usd.read_levels import read_lods
from stereocell.usd.read_stage import loaded, open_stage
from support.bundles import write_bundle
from support.stages import F_ID, HEAD, leaf, write_whole


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


def write_over(stage_path: Path, layer: Path, fields: str, body: str = "") -> Path:
    layer.write_text(f"#usda 1.0\n({fields}\nsubLayers = [@{stage_path}@])\n{body}\n")
    return layer


ALL = ("metersPerUnit = 1e-6", 'upAxis = "Y"', 'defaultPrim = "Specimen"')


@pytest.mark.parametrize("lost", [ALL, ALL[:1], ALL[1:2], ALL[2:]], ids=len)
def test_the_note_names_the_layer_and_the_lines_that_it_lacks(
    stage_path: Path, tmp_path: Path, lost: tuple[str, ...]
) -> None:
    kept = [line for line in ALL if line not in lost]
    layer = write_over(stage_path, tmp_path / "edit.usda", "\n".join(kept))
    line = note_missing(open_stage(layer))
    assert line.startswith(f"{layer}: states no {lost[0].split()[0]}")
    assert line.endswith(f"at the top of the layer: {', '.join(lost)}")
    assert ("10000 times too large" in line) == ("metersPerUnit = 1e-6" in lost)
    assert "\n" not in line
    whole = write_over(stage_path, tmp_path / "whole.usda", "\n".join([*kept, *lost]))
    assert note_missing(open_stage(whole)) == ""


def test_bundle_and_export_report_a_layer_without_units(stage_path: Path, tmp_path: Path) -> None:
    layer = write_over(stage_path, tmp_path / "edit.usda", "")
    note = "states no metersPerUnit, no upAxis, no defaultPrim"
    lines: list[str] = []
    write_bundle(layer, tmp_path / "b", None, engine=Engine(0), report_line=lines.append)
    assert sum(note in line for line in lines) == 1
    lines.clear()
    export_stage(layer, tmp_path / "flat.usdc", options=ExportOptions(), report=lines.append)
    assert sum(note in line for line in lines) == 1
    lines.clear()
    export_stage(stage_path, tmp_path / "own.usdc", options=ExportOptions(), report=lines.append)
    assert not any("states no" in line for line in lines)


@pytest.mark.parametrize(
    ("fields", "remedy"),
    [
        ("metersPerUnit = 1", "expected 1e-06: write metersPerUnit = 1e-6, because"),
        ('upAxis = "Z"', 'expected Y: write upAxis = "Y", because'),
        ('defaultPrim = "Other"', 'expected Specimen: write defaultPrim = "Specimen", because'),
    ],
)
def test_another_unit_axis_or_prim_is_refused_with_the_line_to_write(
    stage_path: Path, tmp_path: Path, fields: str, remedy: str
) -> None:
    layer = write_over(stage_path, tmp_path / "edit.usda", fields)
    with pytest.raises(StageError) as caught:
        open_stage(layer)
    assert str(caught.value).startswith(f"{layer}: ")
    assert remedy in str(caught.value)


@pytest.mark.parametrize(
    ("fields", "remedy"),
    [
        ("metersPerUnit = 0.01", "metersPerUnit is 0.01, expected 1e-06"),
        ('upAxis = "Z"', "upAxis is Z, expected Y"),
    ],
)
def test_wrong_units_of_a_sublayer_are_also_refused(
    stage_path: Path, tmp_path: Path, fields: str, remedy: str
) -> None:
    inner = tmp_path / "inner.usda"
    inner.write_text(f"#usda 1.0\n({fields})\n")
    between = tmp_path / "between.usda"
    between.write_text("#usda 1.0\n(subLayers = [@./inner.usda@])\n")
    layer = tmp_path / "edit.usda"
    layer.write_text(f"{HEAD}subLayers = [@./between.usda@, @{stage_path}@])\n")
    with pytest.raises(StageError) as caught:
        open_stage(layer)
    assert str(caught.value).startswith(f"{inner}: {remedy}: write ")


def test_sublayer_may_have_its_own_default_prim(stage_path: Path, tmp_path: Path) -> None:
    (tmp_path / "inner.usda").write_text('#usda 1.0\n(defaultPrim = "Rig")\ndef "Rig" {}\n')
    layer = tmp_path / "edit.usda"
    layer.write_text(f"{HEAD}subLayers = [@./inner.usda@, @{stage_path}@])\n")
    assert note_missing(open_stage(layer)) == ""


def test_a_face_of_too_many_corners_has_one_remedy(stage_path: Path, tmp_path: Path) -> None:
    over = Usd.Stage.CreateNew(str(tmp_path / "face.usda"))
    over.GetRootLayer().subLayerPaths.append(str(stage_path))
    mesh = over.OverridePrim(leaf("r0_c0", F_ID))
    mesh.GetAttribute("faceVertexCounts").Set([30_000])
    mesh.GetAttribute("faceVertexIndices").Set([0, 1, 2] * 10_000)
    over.Save()
    stage = open_stage(tmp_path / "face.usda")
    with pytest.raises(StageError) as caught, loaded(stage, "r0_c0") as (tile, _):
        list(read_lods(tile, F_ID))
    line = str(caught.value)
    assert "found a face of 30000 corners" in line
    remedy = "triangulate it in the program that edited it, inside the variant lod=lod0"
    assert line.endswith(f"expected at most 20000: {remedy}")

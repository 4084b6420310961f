"""Files that a stage or an artist's layer names are read only from their own folders or below.

Each bait is a valid file. An exporter that opens it therefore succeeds, and the test fails.
"""

import os
import shutil
from pathlib import Path

import pytest
from pxr import Sdf, Usd, UsdGeom

from stereocell.cli.__main__ import main
from stereocell.model.errors import StageError
from stereocell.usd.stage_files import dependencies
from support.phantoms import f_phantom, write_ome_zarr

TILE = "/Specimen/Tiles/r0_c0"
VOLUME = f"{TILE}/Channel0/Channel0_r0_c0_volume"
LOOK = "/Specimen/Channels/Channel0"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An OUT with a stage, to be copied."""
    folder = tmp_path_factory.mktemp("made")
    write_ome_zarr(folder / "v.zarr", [f_phantom()], chunks=(8, 24, 18))
    out = str(folder / "out")
    assert main(["plan", str(folder / "v.zarr"), "-o", out, "--grid", "2x1"]) == 0
    assert main(["units", out, "--workers", "0"]) == 0
    assert main(["stage", out, "--workers", "0"]) == 0
    return folder / "out"


@pytest.fixture
def out(made: Path, tmp_path: Path) -> Path:
    """An OUT in a folder with an apostrophe; the folder `other` beside it is foreign."""
    place = tmp_path / "Ann's data" / "out"
    shutil.copytree(made, place)
    shutil.copytree(made / "stage", tmp_path / "other")
    return place


def edit_of(out: Path, folder: Path) -> tuple[Path, Usd.Stage]:
    """Write an artist's layer over the stage into a separate folder; return its path and stage."""
    folder.mkdir(exist_ok=True)
    layer = Sdf.Layer.CreateNew(str(folder / "edit.usda"))
    layer.subLayerPaths = [str(out / "stage" / "stage.usda")]
    layer.Save()
    return folder / "edit.usda", Usd.Stage.Open(layer)


def bundle(out: Path, stage: Path | None = None) -> int:
    edited = [] if stage is None else ["--stage", str(stage)]
    return main(["bundle", str(out), "--workers", "0", *edited])


def name_asset(stage: Usd.Stage, kind: str, asset: str) -> None:
    """Make a layer name a file as a sublayer, in a prim, in a variant, or in metadata."""
    layer = stage.GetRootLayer()
    if kind == "sublayer":
        layer.subLayerPaths.append(asset)
    elif kind == "payload":
        stage.OverridePrim(TILE).GetPayloads().AddPayload(asset, TILE)
    elif kind == "reference":
        stage.OverridePrim(TILE).GetReferences().AddReference(asset, TILE)
    elif kind == "variant":
        variants = stage.OverridePrim(LOOK).GetVariantSets().AddVariantSet("taste")
        variants.AddVariant("mine")
        with variants.GetVariantEditContext():
            over = stage.OverridePrim(f"{LOOK}/picture")
            over.CreateAttribute("inputs:file", Sdf.ValueTypeNames.Asset).Set(asset)
        variants.ClearVariantSelection()
    elif kind == "metadata":
        stage.OverridePrim(LOOK).SetCustomDataByKey("from", Sdf.AssetPath(asset))
    else:
        path, _, name = kind.rpartition(".")
        prim = Sdf.CreatePrimInLayer(layer, path)  # the prim may be inactive in the variant
        named = Sdf.AttributeSpec(prim, name, Sdf.ValueTypeNames.Asset)
        named.default = Sdf.AssetPath(asset)
    layer.Save()


NAMED = {
    "sublayer": "stage.usda",
    "payload": "stage.usda",
    "reference": "stage.usda",
    "variant": "looks/Channel0_soft.exr",
    "metadata": "looks/Channel0_soft.exr",
    f"{VOLUME}.stereocell:atlas": "tiles/r0_c0/Channel0.exr",
    f"{VOLUME}/density.filePath": "tiles/r0_c0/Channel0.vdb",
    f"{LOOK}.stereocell:lut": "looks/Channel0_soft.exr",
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", NAMED)
@pytest.mark.parametrize("form", ["{}/other/", "../other/"])
def test_a_file_elsewhere_is_refused_and_named(
    out: Path, capsys: pytest.CaptureFixture[str], kind: str, form: str
) -> None:
    root = out.parents[1]
    path, over = edit_of(out, root / "edits")
    asset = form.format(root) + NAMED[kind]
    name_asset(over, kind, asset)
    del over
    capsys.readouterr()
    assert bundle(out, path) == 1
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert line.startswith(f"stereocell: {path}: {asset!r}: leads to {root}/other/")
    assert not (out / "bundle").exists()


@pytest.mark.slow
def test_files_of_the_edit_s_own_folder_and_of_the_stage_s_are_read(out: Path) -> None:
    folder = out.parents[1] / "edits"
    path, over = edit_of(out, folder)
    (folder / "pictures").mkdir()
    shutil.copy(out / "stage/tiles/r0_c0/Channel0.exr", folder / "pictures/mine.exr")
    name_asset(over, f"{VOLUME}.stereocell:atlas", "./pictures/mine.exr")
    name_asset(over, f"{LOOK}.stereocell:lut", str(out / "stage/looks/Channel0_soft.exr"))
    del over
    (folder / "link.usda").symlink_to(path)
    assert bundle(out, folder / "link.usda") == 0


@pytest.mark.slow
def test_symbolic_link_out_of_the_stage_is_refused(
    out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    atlas = out / "stage/tiles/r0_c0/Channel0.exr"
    bait = out.parents[1] / "other/tiles/r0_c0/Channel0.exr"
    atlas.unlink()
    atlas.symlink_to(bait)
    assert bundle(out) == 1
    assert f"leads to {bait}, expected a file in {out}/stage" in capsys.readouterr().err
    assert main(["check", str(out)]) == 1
    printed = capsys.readouterr().out
    assert printed.count(f"leads to {bait}") == 2  # once for the stage, once for its files
    assert "Traceback" not in printed


@pytest.mark.parametrize("name", ["tiles/r0_c0/tile.usdc", "tiles/r0_c0/Channel0.exr"])
def test_pipe_in_the_stage_is_refused_without_waiting(
    out: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    (out / "stage" / name).unlink()
    os.mkfifo(out / "stage" / name)
    assert bundle(out) == 1
    assert "found a folder, device or pipe, expected a regular file" in capsys.readouterr().err
    assert main(["check", str(out)]) == 1
    assert "found a folder, device or pipe, expected a regular file" in capsys.readouterr().out


def test_check_refuses_a_stage_that_leads_out(
    out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stage = Usd.Stage.Open(str(out / "stage/stage.usda"))
    name_asset(stage, "sublayer", "../../../other/stage.usda")
    del stage
    for flags in ((), ("--deep", "--workers", "0")):
        assert main(["check", str(out), *flags]) == 1
        printed = capsys.readouterr().out
        assert "'../../../other/stage.usda': leads to" in printed
    assert "FAIL files of the stage" in printed


def test_variables_in_paths_are_refused(out: Path) -> None:
    """Variables of a stronger layer could change a weaker layer's path."""
    path, over = edit_of(out, out.parents[1] / "edits")
    over.GetRootLayer().expressionVariables = {"WHERE": str(out.parents[1] / "other")}
    over.GetRootLayer().Save()
    with pytest.raises(StageError, match="found expressionVariables"):
        dependencies(path, out / "stage")


def test_layers_inside_a_package_are_followed(out: Path) -> None:
    folder = out.parents[1] / "edits"
    path, over = edit_of(out, folder)
    inner = Sdf.Layer.CreateNew(str(folder / "inner.usda"))
    inner.subLayerPaths = [str(out.parents[1] / "other/stage.usda")]
    inner.Save()
    outer = Sdf.Layer.CreateNew(str(folder / "outer.usda"))
    UsdGeom.Xform.Define(Usd.Stage.Open(outer), "/Extra")
    outer.Save()
    with Sdf.ZipFileWriter.CreateNew(str(folder / "both.usdz")) as package:
        package.AddFile(str(folder / "outer.usda"), "outer.usda")
        package.AddFile(str(folder / "inner.usda"), "inner.usda")
    name_asset(over, "sublayer", "./both.usdz[inner.usda]")
    del over
    with pytest.raises(StageError, match=r"both.usdz\[inner.usda\]: .*leads to .*/other/stage"):
        dependencies(path, out / "stage")


def test_the_files_of_a_stage_are_all_found(out: Path) -> None:
    files = {path.relative_to(out / "stage").as_posix() for path in _all(out)}
    assert {"stage.usda", "looks/channels.usda", "tiles/r0_c1/tile.usdc"} <= files
    written = {p.relative_to(out / "stage").as_posix() for p in (out / "stage").rglob("*.*")}
    # Layers state the paths of these files, but the stage does not compose them.
    levels = {name for name in written if name.endswith("_level.json")}
    assert levels
    apart = {"display.usda", "nvindex.usda", "specimen.usdz", "files.json"}
    assert files == written - apart - levels


def _all(out: Path) -> list[Path]:
    return dependencies(out / "stage" / "stage.usda", out / "stage")


def test_strict_bundle_fails_and_writes_nothing_if_an_edit_is_lost(
    out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, over = edit_of(out, out.parents[1] / "edits")
    channel = over.OverridePrim(LOOK)
    channel.CreateAttribute("inputs:colour", Sdf.ValueTypeNames.Color3f).Set((1, 0, 0))
    over.GetRootLayer().Save()
    command = ["bundle", str(out), "--workers", "0", "--stage", str(path)]
    capsys.readouterr()
    assert main([*command, "--strict"]) == 1
    printed = capsys.readouterr().err
    assert "Channel0.inputs:colour is not taken over: no reader knows this name" in printed
    assert "found 1 edit that no bundle takes over, expected none with --strict" in printed
    assert not (out / "bundle").exists()
    for _ in range(2):  # the second time the bundle is up to date
        assert main(command) == 0
        assert "Channel0.inputs:colour is not taken over" in capsys.readouterr().err
    assert main([*command, "--strict"]) == 1  # fails although the bundle is finished
    channel.RemoveProperty("inputs:colour")
    over.GetRootLayer().Save()
    assert main([*command, "--strict"]) == 0


def test_similar_edits_share_a_line(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, over = edit_of(out, out.parents[1] / "edits")
    for k in range(200):
        over.DefinePrim(f"/Specimen/Sketch/Volume{k}", "Volume")
    over.GetRootLayer().Save()
    capsys.readouterr()
    assert bundle(out, path) == 0
    lines = [line for line in capsys.readouterr().err.splitlines() if "not taken over" in line]
    assert len(lines) == 1
    assert "Volume /Specimen/Sketch/Volume0 (and 199 similar ones) is not taken over" in lines[0]

"""specimen.usdz is small, stands on the floor, has the right colours, and is valid."""

import hashlib
import multiprocessing
import shutil
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdShade

from stereocell.usd import write_usdz as usdz_writer
from stereocell.usd.layer import SHOWN
from stereocell.usd.validate import validate_usdz
from stereocell.usd.write_usdz import write_usdz
from stereocell.verify.formats import check
from support.stages import BALL_ID, COLORS, F_ID, HEAD, SHAPE, SPACING_UM, write_whole


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


@pytest.fixture(scope="module")
def small(stage_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("usdz") / "specimen.usdz"
    assert write_usdz(stage_path, path) == 0
    return path


def meshes(stage: Usd.Stage) -> dict[str, UsdGeom.Mesh]:
    found = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    return {mesh.GetPrim().GetName(): mesh for mesh in found}


def color_of(mesh: UsdGeom.Mesh) -> Gf.Vec3f:
    material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
    return material.ComputeSurfaceSource()[0].GetInput("diffuseColor").Get()


def test_the_validators_of_usdz_find_nothing(small: Path) -> None:
    assert validate_usdz(small) == []


def test_specimen_is_as_large_as_a_hand_and_stands_on_the_floor(small: Path) -> None:
    stage = Usd.Stage.Open(str(small))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    points = [np.array(mesh.GetPointsAttr().Get()) for mesh in meshes(stage).values()]
    low, high = np.concatenate(points).min(axis=0), np.concatenate(points).max(axis=0)
    # Longest edge of the tiles' boxes, which extend half a voxel beyond the voxel centres.
    longest_um = max(n * h for n, h in zip(SHAPE, SPACING_UM, strict=True))
    scale = 0.15 / (longest_um * 1e-6)
    stated = stage.GetRootLayer().customLayerData["stereocell"]
    assert stated["scale"] == pytest.approx(scale)
    assert (stated["size"], stated["lod"]) == (0.15, 0)
    # The F itself is upright and has 24 x 36 voxels.
    assert high[1] - low[1] == pytest.approx(36 * 0.25e-6 * scale, rel=0.03)
    assert low[1] > 0
    assert (np.abs([low[[0, 2]], high[[0, 2]]]) < 0.075).all()


def test_each_channel_has_its_colour_also_after_an_edit(
    small: Path, stage_path: Path, tmp_path: Path
) -> None:
    stage = Usd.Stage.Open(str(small))
    drawn = meshes(stage)
    assert set(drawn) == {f"{c}_{t}" for c in (F_ID, BALL_ID) for t in ("r0_c0", "r0_c1")}
    assert color_of(drawn[f"{F_ID}_r0_c0"]) == Gf.Vec3f(*COLORS[0])
    assert color_of(drawn[f"{BALL_ID}_r0_c1"]) == Gf.Vec3f(*COLORS[1])
    edit = tmp_path / "edit.usda"
    one = f'over "{F_ID}_r0_c1_look"\n{{\ncolor3f inputs:color = (0, 0, 1)\n}}'
    tile = f'over "Tiles"\n{{\nover "r0_c1"\n{{\nover "{F_ID}"\n{{\n{one}\n}}\n}}\n}}'
    edit.write_text(f'{HEAD}subLayers = [@{stage_path}@])\nover "Specimen"\n{{\n{tile}\n}}\n')
    write_usdz(edit, tmp_path / "edit.usdz")
    edited = Usd.Stage.Open(str(tmp_path / "edit.usdz"))
    drawn = meshes(edited)
    assert color_of(drawn[f"{F_ID}_r0_c0"]) == Gf.Vec3f(*COLORS[0])
    assert color_of(drawn[f"{F_ID}_r0_c1"]) == Gf.Vec3f(0, 0, 1)


def test_large_specimen_is_written_at_a_coarser_level(
    stage_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "specimen.usdz"
    monkeypatch.setattr(usdz_writer, "MAX_TRIANGLES", 1)
    assert write_usdz(stage_path, path) == 2  # no level is small enough, so the coarsest is written
    assert validate_usdz(path) == []
    names = zipfile.ZipFile(path).namelist()
    assert names[0] == "specimen.usdc"
    # The coarse level has one normal map for each mesh.
    maps = [f"textures/{c}_{t}_normal.png" for c in (F_ID, BALL_ID) for t in ("r0_c0", "r0_c1")]
    assert sorted(names[1:]) == sorted([*maps, "textures/dome.png"])
    stage = Usd.Stage.Open(str(path))
    mesh = meshes(stage)[f"{F_ID}_r0_c0"]
    material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
    (source,) = material.ComputeSurfaceSource()[0].GetInput("normal").GetValueProducingAttributes()
    file = UsdShade.Shader(source.GetPrim()).GetInput("file").Get()
    assert file.resolvedPath.endswith(f"specimen.usdz[textures/{F_ID}_r0_c0_normal.png]")


def with_one_shown(stage_path: Path, edit: Path, channel: str) -> Usd.Stage:
    """Open a layer over the stage that shows only one channel."""
    edit.write_text(f"{HEAD}subLayers = [@{stage_path}@])\n")
    stage = Usd.Stage.Open(str(edit))
    for prim in stage.GetPrimAtPath(SHOWN).GetChildren():
        if prim.GetName() != channel:
            UsdGeom.Imageable(prim).MakeInvisible()
    return stage


def test_usdz_has_only_visible_channels_unless_their_surfaces_are_hidden(
    stage_path: Path, tmp_path: Path
) -> None:
    edit = tmp_path / "edit.usda"
    stage = with_one_shown(stage_path, edit, BALL_ID)
    stage.Save()
    balls = {f"{BALL_ID}_r0_c0", f"{BALL_ID}_r0_c1"}
    every = balls | {f"{F_ID}_r0_c0", f"{F_ID}_r0_c1"}

    def shown(channels: Sequence[str] = ()) -> set[str]:
        path = tmp_path / "edit.usdz"
        assert write_usdz(edit, path, channels=channels) == 0
        assert validate_usdz(path) == []
        return set(meshes(Usd.Stage.Open(str(path))))

    assert shown() == balls
    assert shown(channels=[F_ID, BALL_ID]) == every
    for prim in [p for p in stage.Traverse() if p.GetName() in balls]:
        UsdGeom.Imageable(prim).MakeInvisible()
    stage.Save()
    assert shown() == every - balls


def test_hidden_channels_do_not_count_for_the_size(
    stage_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    edit, path = tmp_path / "edit.usda", tmp_path / "edit.usdz"
    with_one_shown(stage_path, edit, BALL_ID).Save()
    write_usdz(edit, path)
    balls = Usd.Stage.Open(str(path))
    count = sum(len(mesh.GetFaceVertexCountsAttr().Get()) for mesh in meshes(balls).values())
    monkeypatch.setattr(usdz_writer, "MAX_TRIANGLES", count)
    assert write_usdz(edit, path) == 0
    assert write_usdz(edit, path, channels=[F_ID, BALL_ID]) != 0


def test_faults_of_a_usdz_are_found(stage_path: Path, small: Path, tmp_path: Path) -> None:
    build = tmp_path / "build"
    (build / "stage").mkdir(parents=True)
    packed = build / "stage" / "specimen.usdz"
    shutil.copy(small, packed)
    assert {line.name: line.ok for line in check(build)}["usdz"]
    volume = tmp_path / "tile.usda"
    volume.write_text(
        '#usda 1.0\n(defaultPrim = "V"\nmetersPerUnit = 0.01\nupAxis = "Y")\n'
        'def Volume "V"\n{\ndef OpenVDBAsset "density"\n{\nasset filePath = @./a.vdb@\n}\n}\n'
    )
    with zipfile.ZipFile(packed, "w") as archive:
        archive.write(volume, "tile.usda")
    (line,) = [line for line in check(build) if line.name == "usdz"]
    assert not line.ok
    text = " ".join(str(finding) for finding in validate_usdz(packed))
    assert "metersPerUnit is 0.01 and upAxis is Y, expected 1.0 and Y" in text
    assert "no program draws volumes of usdz" in text
    assert "usdUtilsValidators" in text  # USD finds the file whose bytes are not aligned


@pytest.mark.slow
def test_another_process_writes_the_same_bytes(
    small: Path, stage_path: Path, tmp_path: Path
) -> None:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        pool.apply(write_usdz, (stage_path, tmp_path / "again.usdz"))
    first, second = (
        hashlib.sha256(path.read_bytes()).hexdigest() for path in (small, tmp_path / "again.usdz")
    )
    assert first == second


def test_a_stage_without_meshes_leaves_no_file(stage_path: Path, tmp_path: Path) -> None:
    edit = tmp_path / "edit.usda"
    hidden = "".join(
        f'over "{c}"\n{{\ntoken visibility = "invisible"\n}}\n' for c in (F_ID, BALL_ID)
    )
    tiles = "".join(f'over "{t}"\n{{\n{hidden}\n}}\n' for t in ("r0_c0", "r0_c1"))
    body = f'over "Specimen"\n{{\nover "Tiles"\n{{\n{tiles}\n}}\n}}\n'
    edit.write_text(f"{HEAD}subLayers = [@{stage_path}@])\n{body}")
    (tmp_path / "specimen.usdz").write_bytes(b"an older one")
    assert write_usdz(edit, tmp_path / "specimen.usdz") is None
    assert not (tmp_path / "specimen.usdz").exists()

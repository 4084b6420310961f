"""Each voxel's value is at its true place when other libraries read it, also in oblique scans."""

from collections.abc import Callable
from pathlib import Path

import nibabel
import nrrd
import numpy as np
import pytest
import SimpleITK
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom

from stereocell.cli.__main__ import main
from stereocell.export.options import ExportOptions, parse_region
from stereocell.export.write import export_stage
from stereocell.model.errors import StageError, UsageError
from support import nifti_files, spheres
from support.bundles import write_tiles
from support.dicom_series import grid, sample, scene, turn

NM = 1e-6  # mm


@pytest.fixture(scope="module")
def counted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The stage with CD31's voxels as measured. Each voxel differs from its neighbours."""
    tiles = [spheres.tile(column, (spheres.RED,), measured=True) for column in (0, 1)]
    return write_tiles(tmp_path_factory.mktemp("counted"), tiles)


WHOLE = (9, 20, 40)  # voxels (z, y, x) of both tiles
COUNTS = spheres.counts((0, 0, 0), WHOLE)


def unit(ending: str) -> float:
    """Return the number that 1 um has in SimpleITK, which reads NIfTI in mm."""
    return 1e-3 if ending.startswith("nii") else 1.0


def read(path: Path) -> tuple[NDArray[np.generic], SimpleITK.Image]:
    image = SimpleITK.ReadImage(str(path))
    return SimpleITK.GetArrayFromImage(image), image


@pytest.mark.parametrize("ending", ["nrrd", "nhdr", "nii.gz", "nii"])
def test_values_of_the_source_are_at_their_places(
    counted: Path, tmp_path: Path, ending: str
) -> None:
    name = "s.raw" if ending == "nhdr" else f"s.{ending}"
    line = export_stage(
        counted, tmp_path / name, options=ExportOptions(units="um", channels=("CD31",))
    )
    values, image = read(tmp_path / f"s.{ending}")
    np.testing.assert_array_equal(values, COUNTS)
    um = unit(ending)
    assert image.GetSpacing() == pytest.approx([um * n for n in spheres.SPACING[::-1]])
    assert image.GetOrigin() == pytest.approx((0, 0, 0))
    assert image.GetDirection() == pytest.approx(np.eye(3).ravel())
    assert line.startswith("40 x 20 x 9 voxels of uint16, CD31: the source's values")
    before = (tmp_path / name).read_bytes()
    export_stage(counted, tmp_path / name, options=ExportOptions(units="um", channels=("CD31",)))
    assert (tmp_path / name).read_bytes() == before


def test_8_bit_file_has_channels_with_their_names(sphere_stage: Path, tmp_path: Path) -> None:
    balls = spheres.ball((0, 0, 0), WHOLE)
    export_stage(sphere_stage, tmp_path / "s.nrrd", options=ExportOptions())
    values, image = read(tmp_path / "s.nrrd")
    assert image.GetNumberOfComponentsPerPixel() == 2
    for channel in (0, 1):
        np.testing.assert_array_equal(values[..., channel], balls)
    voxels, head = nrrd.read(str(tmp_path / "s.nrrd"))
    assert voxels.shape == (*WHOLE[::-1], 2)
    assert (head["channel_0"], head["channel_1"]) == ("CD31", "Hoechst 33342")
    assert head["space units"] == ["mm"] * 3
    np.testing.assert_allclose(np.diag(head["space directions"][:3]), [5e-4, 5e-4, 1e-3])
    export_stage(sphere_stage, tmp_path / "s.nii.gz", options=ExportOptions())
    found = nibabel.load(tmp_path / "s.nii.gz")
    assert found.shape == (*WHOLE[::-1], 2)
    (names,) = found.header.extensions
    assert names.get_content() == b'{"channels": ["CD31", "Hoechst 33342"]}'
    assert found.header.get_xyzt_units()[0] == "mm"


@pytest.mark.parametrize("ending", ["nrrd", "nii.gz"])
def test_a_specimen_that_was_turned_lies_obliquely(
    sphere_stage: Path, edited: Callable[..., Path], tmp_path: Path, ending: str
) -> None:
    def move(stage: Usd.Stage) -> None:
        tiles = UsdGeom.XformCommonAPI(stage.GetPrimAtPath("/Specimen/Tiles"))
        tiles.SetRotate(Gf.Vec3f(20, 30, 40))
        tiles.SetTranslate((100, 200, 300))

    path = tmp_path / f"s.{ending}"
    export_stage(edited(move), path, options=ExportOptions(units="um", channels=("CD31",)))
    values, image = read(path)
    weights = np.clip(values.astype(float) - 100, 0, None)
    middle = [np.average(n, weights=weights) for n in np.indices(values.shape)[::-1]]
    place = image.TransformContinuousIndexToPhysicalPoint(middle)
    stage = Usd.Stage.Open(str(tmp_path / "edited.usda"))
    to_world = UsdGeom.Xformable(stage.GetPrimAtPath("/Specimen/Tiles")).GetLocalTransformation()
    x, y, z = to_world.Transform(Gf.Vec3d(*spheres.CENTER.tolist()))
    um = unit(ending)
    assert place == pytest.approx((um * x, um * -y, um * z), abs=0.02 * um)
    assert np.abs(np.array(image.GetDirection())).max() < 0.98


def test_region_of_a_turned_specimen_is_the_smallest_box_of_voxels_round_it(
    sphere_stage: Path, edited: Callable[..., Path], tmp_path: Path
) -> None:
    """In a scanner, patients often lie turned by some degrees."""

    def move(stage: Usd.Stage) -> None:
        tiles = UsdGeom.XformCommonAPI(stage.GetPrimAtPath("/Specimen/Tiles"))
        tiles.SetRotate(Gf.Vec3f(5, 10, 20))

    layer, options = edited(move), {"units": "um", "channels": ("CD31",)}
    export_stage(layer, tmp_path / "s.nrrd", options=ExportOptions(**options))
    whole, image = read(tmp_path / "s.nrrd")
    k, j, i = np.indices(whole.shape).reshape(3, -1)
    index = np.stack([i, j, k], axis=-1)
    turned = np.array(image.GetDirection()).reshape(3, 3) * image.GetSpacing()
    places = (index @ turned.T + image.GetOrigin()) * (1, -1, 1)
    box = parse_region("9:12,-2:1,:5")
    export_stage(layer, tmp_path / "t.nrrd", options=ExportOptions(**options, region=box))
    values, part = read(tmp_path / "t.nrrd")
    first = image.TransformPhysicalPointToContinuousIndex(part.GetOrigin())
    x, y, z = np.rint(first).astype(int).tolist()
    assert first == pytest.approx((x, y, z), abs=1e-3)
    size_z, size_y, size_x = values.shape
    np.testing.assert_array_equal(values, whole[z : z + size_z, y : y + size_y, x : x + size_x])
    is_within = ((places >= box.low) & (places <= box.high)).all(axis=1)
    assert is_within.any()
    found = index[is_within] - (x, y, z)
    assert (found >= 0).all()
    assert (found < (size_x, size_y, size_z)).all()
    assert values.size < whole.size / 2


def test_empty_region_is_refused_with_the_extent_of_the_content(
    sphere_stage: Path, tmp_path: Path
) -> None:
    for name, kind in (("s.glb", "surface"), ("s.png", "surface"), ("s.nrrd", "voxel")):
        options = ExportOptions(
            region=parse_region(":,:,7.2:7.4" if kind == "voxel" else ":,:,7.9:")
        )
        expected = (
            f"--region: found no {kind} in it, expected a box that overlaps -0.25:19.75,-9.75:0"
        )
        with pytest.raises(UsageError, match=expected):
            export_stage(sphere_stage, tmp_path / name, options=options)


@pytest.mark.slow
def test_voxels_of_an_oblique_scan_are_at_the_place_in_the_patient(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shape = (16, 20, 18)
    affine = grid("sagittal", shape, rotation=turn((1, 2, 3), 25), shift=(5.0, -7.0, 3.0))
    voxels = np.rint(sample(affine, shape)).astype(np.int16)
    nifti_files.write(tmp_path / "a.nii", affine, voxels)
    out = tmp_path / "out"
    assert main(["plan", str(tmp_path / "a.nii"), "-o", str(out), "--preset", "none"]) == 0
    for phase in ("units", "stage"):
        assert main([phase, str(out), "--workers", "0"]) == 0
    for name in ("b.nrrd", "b.nii.gz"):
        capsys.readouterr()
        assert main(["export", str(out), str(tmp_path / name)]) == 0
        printed = capsys.readouterr()
        assert printed.out.startswith(f"wrote {tmp_path / name}: ")
        assert "export: 1/1 r0_c0" in printed.err
        values, image = read(tmp_path / name)
        k, j, i = np.indices(values.shape)
        index = np.stack([i, j, k], axis=-1).reshape(-1, 3)
        turned = np.array(image.GetDirection()).reshape(3, 3) * image.GetSpacing()
        places = index @ turned.T + image.GetOrigin()
        assert values.size == voxels.size
        np.testing.assert_allclose(values.ravel(), np.rint(scene(places)), atol=1)
        assert sorted(values.ravel().tolist()) == sorted(voxels.ravel().tolist())


def test_a_region_and_a_tile_are_cut_out(counted: Path, tmp_path: Path) -> None:
    options = ExportOptions(units="um", region=parse_region("9:12,-5:-2,3:4"))
    export_stage(counted, tmp_path / "s.nrrd", options=options)
    values, image = read(tmp_path / "s.nrrd")
    np.testing.assert_array_equal(values, COUNTS[3:5, 4:11, 18:25])
    assert image.GetOrigin() == pytest.approx((9, 2, 3))
    export_stage(counted, tmp_path / "s.nrrd", options=ExportOptions(units="um", tiles=("r0_c1",)))
    values, image = read(tmp_path / "s.nrrd")
    np.testing.assert_array_equal(values, COUNTS[:, :, 20:])
    assert image.GetOrigin() == pytest.approx((10, 0, 0))


def test_a_tile_that_was_moved_by_whole_voxels_is_moved_and_by_others_refused(
    counted: Path, tmp_path: Path
) -> None:
    for by, is_fit in ((3.0, True), (3.2, False)):
        path = tmp_path / f"{by}.usda"
        stage = Usd.Stage.CreateNew(str(path))
        stage.GetRootLayer().subLayerPaths = [str(counted)]
        moved = UsdGeom.XformCommonAPI(stage.GetPrimAtPath("/Specimen/Tiles/r0_c1"))
        moved.SetTranslate((0, -by, 0))
        stage.GetRootLayer().Save()
        if is_fit:
            export_stage(path, tmp_path / "s.nrrd", options=ExportOptions())
            values, _ = read(tmp_path / "s.nrrd")
            np.testing.assert_array_equal(values[:, 6:26, 21:], COUNTS[:, :, 21:])
            assert not values[:, :6, 21:].any()
        else:
            with pytest.raises(StageError, match="r0_c1: found a move by a part of a voxel"):
                export_stage(path, tmp_path / "s.nrrd", options=ExportOptions())


def test_file_for_unity_has_one_upright_channel_and_an_ini_file(
    sphere_stage: Path, tmp_path: Path
) -> None:
    with pytest.raises(UsageError, match="--unity: found 2 channels, expected one"):
        export_stage(sphere_stage, tmp_path / "s.raw", options=ExportOptions(unity=True))
    options = ExportOptions(unity=True, channels=("CD31",))
    export_stage(sphere_stage, tmp_path / "s.raw", options=options)
    ini = dict(line.split(":") for line in (tmp_path / "s.raw.ini").read_text("utf-8").split())
    assert ini == {
        "dimx": "40", "dimy": "20", "dimz": "9", "skip": "0", "format": "uint8",
        "endianness": "LittleEndian",
    }  # fmt: skip
    ball = spheres.ball((0, 0, 0), WHOLE)
    values = np.fromfile(tmp_path / "s.raw", "u1").reshape(WHOLE)
    # Unity's y grows upwards, and its z away from the viewer. Otherwise the volume is mirrored.
    np.testing.assert_array_equal(values, ball[::-1, ::-1])
    export_stage(sphere_stage, tmp_path / "s.nrrd", options=options)
    upright, image = read(tmp_path / "s.nrrd")
    np.testing.assert_array_equal(upright, values)
    assert image.TransformIndexToPhysicalPoint((0, 19, 8)) == pytest.approx((0, 0, 0), abs=NM)


def test_default_bits_are_those_of_the_stage(
    sphere_stage: Path, counted: Path, tmp_path: Path
) -> None:
    with pytest.raises(
        UsageError, match="--bits is 16, expected 8, because the stage has 8 bits of CD31"
    ):
        export_stage(
            sphere_stage, tmp_path / "s.nrrd", options=ExportOptions(bits=16, channels=("CD31",))
        )
    export_stage(counted, tmp_path / "s.nrrd", options=ExportOptions(bits=8))
    low, high = spheres.RED.window
    share = ((COUNTS - low) / (high - low)).clip(0, 1)
    np.testing.assert_allclose(read(tmp_path / "s.nrrd")[0], 255 * share, atol=0.51)

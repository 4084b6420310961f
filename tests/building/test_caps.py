"""Surfaces at the ends of the block have flat caps in a fixed order, or are open on request."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.export.unite import weld
from stereocell.meshes.validity import border
from stereocell.model.mesh import Mesh
from stereocell.report.facts import gather
from stereocell.report.remarks import find_remarks
from stereocell.steps.unit_files import load_lods
from support import phantoms
from support.validators import make_assets

SHAPE = (16, 40, 72)
SPACING = {"z": 1.0, "y": 0.5, "x": 0.5}
# Lengths (x, y, z) in um of the box through the outermost voxels' centres; y is negative
LOW, HIGH = np.array([0.0, -19.5, 0.0]), np.array([35.5, 0.0, 15.0])
NAMES = ("red", "green", "blue")
LEVELS = [f"{name}=500" for name in NAMES]
FLAGS = [text for level in LEVELS for text in ("--iso-value", level)]
# caps lie at eighths of half a voxel
HAIR = 0.5 / 8


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write three channels that all reach through the block, so that caps overlap on all faces."""
    rng = np.random.default_rng(2)
    z, y, x = np.indices(SHAPE)
    channels = []
    for number in range(len(NAMES)):
        waves = np.sin(x / (5 + number)) + np.sin(y / (6 + number)) + np.sin(z / 4 + number)
        channels.append(500 + 300 * (waves + 0.8) + rng.normal(0, 15, SHAPE))
    voxels = np.clip(np.stack(channels), 0, 4000).astype(np.uint16)
    place = tmp_path_factory.mktemp("caps") / "waves.ome.zarr"
    labels = [{"label": name} for name in NAMES]
    return phantoms.write_ome_zarr(place, [voxels], "czyx", scales=[SPACING], channels=labels)


@pytest.fixture(scope="module")
def capped(source: Path) -> Path:
    out = source.parent / "capped"
    assert make_assets(source, out, "2x1", "--workers", "0", plan=FLAGS) == 0
    return out


@pytest.fixture(scope="module")
def bare(source: Path) -> Path:
    out = source.parent / "bare"
    assert make_assets(source, out, "2x1", "--workers", "0", plan=[*FLAGS, "--no-caps"]) == 0
    return out


def _levels(out: Path, channel: str) -> list[list[Mesh]]:
    """Return the meshes of a channel's tiles, by level."""
    folder = OutFolder(out)
    tiles = [
        [lod.mesh for lod in load_lods(folder.unit_dir(unit, key))]
        for unit, key in folder.index().items()
        if unit.endswith(f"/{channel}")
    ]
    return [list(level) for level in zip(*tiles, strict=True)]


def _flat_area(mesh: Mesh, axis: int, place: np.float32) -> float:
    """Return the area of a mesh that lies exactly in a plane."""
    corners = mesh.positions[mesh.triangles]
    a, b, c = corners[(corners[:, :, axis] == place).all(axis=1)].astype(float).transpose(1, 0, 2)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def _ends(meshes: list[Mesh]) -> NDArray[np.float32]:
    """Return the least and largest position of meshes along each axis, (2, 3)."""
    every = np.concatenate([mesh.positions for mesh in meshes])
    return np.array([every.min(axis=0), every.max(axis=0)])


def test_caps_are_flat_and_lie_in_the_channels_order_at_each_level(capped: Path) -> None:
    spacing = np.array([SPACING[axis] for axis in "xyz"])
    for number, name in enumerate(NAMES):
        past = (0.5 - HAIR * (number + 1)) * spacing
        expected = np.array([LOW - past, HIGH + past])
        levels = _levels(capped, name)
        finest = None
        for meshes in levels:
            ends = _ends(meshes)
            np.testing.assert_allclose(ends, expected, atol=1e-5)
            areas = [
                sum(_flat_area(mesh, axis, ends[side, axis]) for mesh in meshes)
                for axis in range(3)
                for side in range(2)
            ]
            finest = finest or areas
            # rims get coarser, by four voxels at the last level, where objects end in points
            if meshes is not levels[-1]:
                assert np.divide(areas, finest).min() > 0.5
        assert finest is not None
        assert min(finest) > 50


def test_no_surface_passes_its_own_caps_beside_those_of_another_channel(capped: Path) -> None:
    """The order also holds beside the flat parts, because no vertex leaves its cap."""
    for level in range(len(_levels(capped, NAMES[0]))):
        ends = np.array([_ends(_levels(capped, name)[level]) for name in NAMES])
        assert (np.diff(ends[:, 0], axis=0) > 0).all()
        assert (np.diff(ends[:, 1], axis=0) < 0).all()


def test_tiles_with_caps_are_one_closed_surface(capped: Path) -> None:
    for name in NAMES:
        for meshes in _levels(capped, name):
            _, triangles = weld([(mesh.positions, mesh.triangles) for mesh in meshes])
            assert len(border(triangles)) == 0


def test_cap_normals_face_out_of_the_block(capped: Path) -> None:
    for name in NAMES:
        meshes = _levels(capped, name)[0]
        low, high = _ends(meshes)
        for mesh in meshes:
            for axis in range(3):
                for place, way in ((low[axis], -1), (high[axis], 1)):
                    on_cap = mesh.positions[:, axis] == place
                    np.testing.assert_array_equal(mesh.normals[on_cap, axis], way)


def test_without_caps_all_rims_lie_on_the_block_s_faces(bare: Path) -> None:
    for name in NAMES:
        for meshes in _levels(bare, name):
            places, triangles = weld([(mesh.positions, mesh.triangles) for mesh in meshes])
            edges = border(triangles)
            assert len(edges) > 100
            ends = places[edges]
            on_face = (ends == LOW.astype(np.float32)) | (ends == HIGH.astype(np.float32))
            assert on_face.all(axis=1).any(axis=1).all()
            assert (places >= LOW.astype(np.float32)).all()
            assert (places <= HIGH.astype(np.float32)).all()


def test_report_and_check_say_that_surfaces_are_open_on_purpose(
    bare: Path, capped: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (remark,) = [one for one in find_remarks(gather(OutFolder(bare))) if "open at" in one.title]
    assert remark.is_note
    assert [line.split(":")[0] for line in remark.lines] == list(NAMES)
    assert all("--no-caps" in line for line in remark.lines)
    assert not [one for one in find_remarks(gather(OutFolder(capped))) if "open at" in one.title]
    for out, expected in ((bare, 1), (capped, 0)):
        capsys.readouterr()
        assert main(["check", str(out), "--deep", "--workers", "0"]) == 0
        assert capsys.readouterr().out.count("open at the block's faces on purpose") == expected


def test_open_surfaces_are_exported_but_not_as_solids(
    bare: Path, capped: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(bare), str(tmp_path / "open.glb")]) == 0
    assert main(["export", str(capped), str(tmp_path / "solid.3mf")]) == 0
    capsys.readouterr()
    assert main(["export", str(bare), str(tmp_path / "open.3mf")]) == 1
    output = capsys.readouterr().err.splitlines()[-1]
    assert "found a surface that is open at the block's faces (--no-caps)" in output
    assert not (tmp_path / "open.3mf").exists()

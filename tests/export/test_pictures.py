"""Pictures show the specimen, turntables go round it once, and bytes are the same each time."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from PIL import Image
from pxr import Gf, Usd, UsdGeom

from stereocell.export import pictures
from stereocell.export.chosen import Chosen
from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.model.errors import UsageError
from stereocell.report.draw_scenes import draw_image
from stereocell.textures.draw_meshes import Shape, turning_frame
from stereocell.usd.layer import SHOWN
from support import spheres
from support.bundles import CD31


def read(path: Path) -> list[NDArray[np.uint8]]:
    """Return the frames of a video, (y, x, 3)."""
    ffmpeg = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-i", str(path)]
    folder = path.parent / "frames"
    folder.mkdir()
    subprocess.run([*ffmpeg, str(folder / "%03d.png")], check=True)
    return [np.asarray(Image.open(one).convert("RGB")) for one in sorted(folder.iterdir())]


def covered(pixels: NDArray[np.uint8]) -> NDArray[np.bool_]:
    return pixels.astype(int).max(axis=-1) > 40


@pytest.mark.slow
def test_a_picture_opens_with_the_channels_that_the_stage_shows(
    edited: Callable[..., Path], tmp_path: Path
) -> None:
    def show_one(stage: Usd.Stage) -> None:
        for prim in stage.GetPrimAtPath(SHOWN).GetChildren():
            if prim.GetName() != "CD31":
                UsdGeom.Imageable(prim).MakeInvisible()

    layer, small = edited(show_one), ExportOptions(width=64)
    note = "only CD31, as the viewer shows at opening: --channels chooses others"
    for file, options, is_reported in (
        ("s.png", small, True),
        ("t.png", replace(small, channels=("CD31", "Hoechst 33342")), False),
        ("s.usdz", ExportOptions(), True),
        ("s.glb", ExportOptions(), True),
        ("s.stl", ExportOptions(), False),
    ):
        lines: list[str] = []
        export_stage(layer, tmp_path / file, options=options, report=lines.append)
        assert (note in lines) == is_reported
    chosen = Chosen(layer, small)
    chosen.show_as_viewer()
    assert [channel.name for channel in chosen.channels] == ["CD31"]


def test_picture_shows_other_channels_if_visible_ones_have_hidden_surfaces(
    edited: Callable[..., Path],
) -> None:
    def hide(stage: Usd.Stage) -> None:
        prim = stage.GetPrimAtPath(CD31)
        for one in stage.GetPrimAtPath(SHOWN).GetChildren():
            if one.GetName() != prim.GetName():
                UsdGeom.Imageable(one).MakeInvisible()
        for tile in stage.GetPrimAtPath("/Specimen/Tiles").GetChildren():
            surface = stage.OverridePrim(tile.GetPath().AppendChild(prim.GetName()))
            UsdGeom.Imageable(surface).MakeInvisible()

    chosen = Chosen(edited(hide), ExportOptions(width=64))
    chosen.show_as_viewer()
    assert len(chosen.channels) > 1


@pytest.mark.slow
def test_a_picture_shows_the_sphere_in_its_edited_colour(
    edited: Callable[..., Path], tmp_path: Path
) -> None:
    def paint(stage: Usd.Stage) -> None:
        stage.GetAttributeAtPath(f"{CD31}.inputs:color").Set(Gf.Vec3f(0.0, 0.8, 0.0))

    layer = edited(paint)
    line = export_stage(layer, tmp_path / "s.png", options=ExportOptions(width=300))
    pixels = np.asarray(Image.open(tmp_path / "s.png").convert("RGB"))
    assert line == f"300 x {len(pixels)} pixels at lod0"
    seen = covered(pixels)
    red, green, blue = pixels[seen].mean(axis=0)
    assert green > 2 * max(red, blue)
    # Width and area have the ratio of a circle.
    width = np.ptp(np.flatnonzero(seen.any(axis=0))) + 1
    assert seen.sum() == pytest.approx(np.pi / 4 * width**2, rel=0.03)
    # The sphere's box, seen from a corner, fills the picture. The tiles' boxes are 3 times as wide.
    assert 0.6 < width / 300 < 0.75
    before = (tmp_path / "s.png").read_bytes()
    export_stage(layer, tmp_path / "s.png", options=ExportOptions(width=300))
    assert (tmp_path / "s.png").read_bytes() == before


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["mp4", "webm"])
def test_a_turntable_goes_once_round(
    sphere_stage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str
) -> None:
    monkeypatch.setattr(pictures, "_FRAMES", 8)
    path = tmp_path / f"s.{ending}"
    # A bowl, which looks different from each side.
    half = ExportOptions(width=160, tiles=("r0_c0",))
    export_stage(sphere_stage, path, options=half)
    frames = read(path)
    height, width, _ = frames[0].shape
    assert (width, len(frames)) == (160, 8)
    assert height % 2 == 0
    seen = [covered(frame) for frame in frames]
    assert all(one.any() for one in seen)
    # Red is visible in each frame, and frames differ.
    for frame, one in zip(frames, seen, strict=True):
        assert frame[one][:, 0].mean() > frame[one][:, 2].mean()
    assert all((a ^ b).sum() > 30 for a, b in pairwise(seen))
    before = path.read_bytes()
    export_stage(sphere_stage, path, options=half)
    assert path.read_bytes() == before


def test_missing_package_for_turntables_is_reported_with_how_to_install_it(
    sphere_stage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(UsageError, match=r"pip install 'stereocell\[video\]'"):
        export_stage(sphere_stage, tmp_path / "s.mp4", options=ExportOptions())
    assert not list(tmp_path.iterdir())


def test_eye_of_a_turntable_moves_to_the_right() -> None:
    mesh = spheres.sphere(8, slice(None))
    moved = mesh.positions - spheres.CENTER.astype(np.float32)
    dot = Shape(
        moved + np.float32([0, 0, 8]), mesh.triangles, mesh.normals, np.array([1.0, 1.0, 1.0])
    )
    frame = (-12.0, -12.0, -12.0), (12.0, 12.0, 12.0)

    def middle(turned: float) -> float:
        seen = covered(np.asarray(draw_image([dot], frame, (200, 200), turned_deg=turned)))
        return float(np.flatnonzero(seen.any(axis=0)).mean())

    # The dot is in front of the specimen. As the eye moves to the right, the dot moves to the left.
    assert middle(0) > middle(30) > middle(60)


@pytest.mark.parametrize("turned", [0.0, 40.0, 95.0, 140.0, 337.2])
def test_long_box_fits_at_every_angle(turned: float) -> None:
    low, high = np.array([-30.0, -4.0, -8.0]), np.array([30.0, 4.0, 8.0])
    box = trimesh.creation.box(bounds=(low, high))
    shape = Shape(
        box.vertices.astype(np.float32),
        box.faces.astype(np.uint32),
        np.ones((8, 3), np.float32),
        np.ones(3),
    )
    image = draw_image([shape], turning_frame(low, high), (200, 200), turned_deg=turned)
    seen = covered(np.asarray(image))
    assert seen.sum() > 1000
    borders = (seen[0], seen[-1], seen[:, 0], seen[:, -1])
    assert not any(border.any() for border in borders)

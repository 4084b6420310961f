"""Pictures of meshes: where things are, what hides what, and how light falls."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from numpy.typing import NDArray
from PIL import Image

from stereocell.model.mesh import Lod, Mesh
from stereocell.model.unit import Unit
from stereocell.report.draw_scenes import Scene, Surface, draw_scene
from stereocell.steps.unit_files import save_unit

FRAME = ((-10.0, -10.0, -10.0), (10.0, 10.0, 10.0))
RED, BLUE = (1.0, 0.02, 0.02), (0.02, 0.02, 1.0)
EYE = np.array([0.42, 0.5, 1.0]) / np.linalg.norm([0.42, 0.5, 1.0])


def ball(center: NDArray[np.float64], radius: float) -> Mesh:
    found = pv.Icosphere(radius, center, nsub=4)
    normals = (found.points - center) / radius
    return Mesh(np.asarray(found.points), found.regular_faces.astype(np.uint32), normals)


def surface(folder: Path, mesh: Mesh, color: tuple[float, float, float]) -> Surface:
    """Save a unit with one level of detail, and return its surface."""
    save_unit(folder, Unit((Lod(mesh, 0.0),), None, None, "", 0, 0, {}))
    return Surface(folder, 0, color)


def picture_of(*surfaces: Surface, boxes: tuple[object, ...] = ()) -> NDArray[np.int64]:
    drawn = draw_scene(Scene(surfaces, boxes, FRAME, (300, 300)))  # type: ignore[arg-type]
    with Image.open(io.BytesIO(drawn.data)) as image:
        assert image.size == (drawn.width, drawn.height)
        return np.asarray(image.convert("RGB")).astype(np.int64)


def test_a_ball_is_a_disc_in_the_middle_of_its_size(tmp_path: Path) -> None:
    picture = picture_of(surface(tmp_path / "ball", ball(np.zeros(3), 6.0), RED))
    is_ball = picture[..., 0] > 60
    rows, columns = np.nonzero(is_ball)
    assert abs(rows.mean() - (picture.shape[0] - 1) / 2) < 1
    assert abs(columns.mean() - (picture.shape[1] - 1) / 2) < 1
    # the frame's box is wider than high from the eye
    right = np.cross([0.0, 1.0, 0.0], EYE) / np.linalg.norm(np.cross([0.0, 1.0, 0.0], EYE))
    scale = picture.shape[1] / (20 * np.abs(right).sum()) / 1.04
    up = np.cross(EYE, right)
    scale = min(scale, picture.shape[0] / (20 * np.abs(up).sum()) / 1.04)
    assert is_ball.sum() == pytest.approx(np.pi * (6 * scale) ** 2, rel=0.02)


def test_light_comes_over_the_left_shoulder(tmp_path: Path) -> None:
    picture = picture_of(surface(tmp_path / "ball", ball(np.zeros(3), 6.0), RED))[..., 0]
    middle = np.array(picture.shape) // 2
    at = 40
    upper_left, lower_right = picture[tuple(middle - at)], picture[tuple(middle + at)]
    assert upper_left > lower_right + 40 > 60


def test_the_nearer_surface_hides_the_farther_one_in_either_order(tmp_path: Path) -> None:
    near = surface(tmp_path / "near", ball(4 * EYE, 3.0), RED)
    far = surface(tmp_path / "far", ball(-4 * EYE, 4.5), BLUE)
    for order in ((near, far), (far, near)):
        picture = picture_of(*order)
        middle = picture[picture.shape[0] // 2, picture.shape[1] // 2]
        assert middle[0] > middle[2] + 50
        is_blue = picture[..., 2] > picture[..., 0] + 30
        assert is_blue.sum() > 1000  # a ring of the larger one is seen


def test_the_inside_of_an_open_shell_is_lit(tmp_path: Path) -> None:
    whole = ball(np.zeros(3), 6.0)
    towards = whole.positions[whole.triangles].mean(axis=1) @ EYE
    half = replace(whole, triangles=whole.triangles[towards < 0])  # the half that faces away
    picture = picture_of(surface(tmp_path / "shell", half, RED))
    assert picture[picture.shape[0] // 2, picture.shape[1] // 2, 0] > 100


def test_boxes_are_hidden_behind_surfaces_and_drawn_before_them(tmp_path: Path) -> None:
    box = ((-8.0, -8.0, -8.0), (8.0, 8.0, 8.0))
    around = picture_of(boxes=(box,))
    lines = np.abs(around - around[0, 0]).sum(axis=2) > 60
    assert 500 < lines.sum() < 8000
    covered = picture_of(surface(tmp_path / "ball", ball(np.zeros(3), 7.9), RED), boxes=(box,))
    is_line = np.abs(covered - around).sum(axis=2) < 24
    assert 0.4 < (is_line & lines).sum() / lines.sum() < 0.8  # the ball hides the lines behind it


def test_an_empty_scene_is_a_picture() -> None:
    picture = picture_of()
    assert (picture == picture[0, 0]).all()

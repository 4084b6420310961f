"""The alpha wrap of triangles, with its package from the dev group, and the error without it."""

from pathlib import Path

import numpy as np
import pytest

from stereocell.cli.__main__ import main
from stereocell.isosurface.extract import extract_surface
from stereocell.meshes import alpha_wrap
from stereocell.meshes.validity import find_defects
from stereocell.model.lattice import Lattice
from stereocell.model.tiling import Box
from support.phantoms import blurred_ball, write_ome_tiff

SPACING = (0.5, 0.25, 0.25)


def _source(folder: Path) -> str:
    ball = 1000 * blurred_ball((24, 40, 40), SPACING, (6.0, 5.0, 5.0), 3.0, 0.3)
    write_ome_tiff(folder / "ball.ome.tif", ball.astype(np.uint16), spacing=SPACING)
    return str(folder / "ball.ome.tif")


def test_the_wrap_refuses_more_than_one_tile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("stereocell.planning.settle.find_wrapper", lambda: "1")
    flags = ["-o", str(tmp_path / "out"), "--wrap", "alpha-wrap", "--grid", "2x1"]
    assert main(["plan", _source(tmp_path), *flags]) == 2
    assert "closes each tile by itself, and the plan has 2 tiles, expected one tile" in (
        capsys.readouterr().err
    )


def test_the_error_for_a_missing_package_says_how_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(alpha_wrap, "LIBRARY", "no_such_wrapper")
    out = tmp_path / "out"
    assert main(["plan", _source(tmp_path), "-o", str(out), "--wrap", "alpha-wrap"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "--wrap 'alpha-wrap' needs the package no_such_wrapper" in line
    assert line.endswith("pip install 'stereocell[alpha-wrap]'")
    assert not out.exists()


def test_the_error_for_an_unknown_wrap_lists_the_known_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flags = ["-o", str(tmp_path / "out"), "--wrap", "foil"]
    assert main(["plan", _source(tmp_path), *flags]) == 2
    assert "'foil', expected one of voxels, alpha-wrap" in capsys.readouterr().err


@pytest.mark.slow
def test_the_wrap_is_closed_and_lies_at_the_offset_from_the_surface() -> None:
    shape = (30, 40, 40)
    z, y, x = np.indices(shape) - np.float64(14.6)
    distance = np.clip(9 - np.sqrt(z**2 + y**2 + x**2), -2, 2).astype(np.float32)
    whole = Box((0, 0, 0), shape)
    ball = extract_surface(distance, Lattice.of_whole(whole, (1, 1, 1)))
    wrapped = alpha_wrap.alpha_wrap(ball, 2.0, 0.5)
    assert not find_defects(wrapped).total
    outward = wrapped.positions - np.float32([14.6, -14.6, 14.6])
    away = np.linalg.norm(outward, axis=1) - 9
    assert 0.3 < np.median(away) < 0.6
    assert ((wrapped.normals * outward).sum(axis=1) > 0).all()

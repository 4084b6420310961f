"""Measured values of voxels over HTTP: only those of the stage from which the bundle was made."""

import json
import shutil
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest

from stereocell.serve.measured_values import parse_place
from support.phantoms import write_ome_tiff
from support.server.requests import ask
from support.server.running import serving
from support.validators import make_assets

SPACING_UM = (0.5, 0.25, 0.25)
SHAPE = (16, 48, 36)


def counts() -> np.ndarray[Any, np.dtype[np.int16]]:
    return np.random.default_rng(4).normal(-300, 90, SHAPE).round().astype(np.int16)


def build(folder: Path, *flags: str) -> Path:
    """Build two tiles, to be changed by none of the tests."""
    source = write_ome_tiff(folder / "f.ome.tif", counts(), spacing=SPACING_UM, names=["F"])
    arguments = ("--iso-value", "F=900", "--preset", "none", *flags)
    assert make_assets(source, folder / "out", "2x1", "--workers", "0", plan=arguments) == 0
    (folder / "out/bundle/index.html").write_text("<!doctype html>")
    return folder / "out"


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("values"))


def value(port: int, place: str, at: str) -> float | None:
    response, body = ask(port, f"/values/{place}?at={quote(at)}")
    assert response.status == 200
    found: float | None = json.loads(body)["value"]
    return found


def at_voxel(z: float, y: float, x: float) -> str:
    return f"{x * 0.25},{-y * 0.25},{z * 0.5}"


@pytest.mark.slow
def test_every_voxel_has_the_value_that_was_measured(out: Path) -> None:
    rng = np.random.default_rng(0)
    with serving(out) as server:
        port = server.port
        response, _ = ask(port, "/manifest.json")
        assert response.headers["Stereocell-Values"] == "version=1"
        for _ in range(40):
            z, y, x = (int(rng.integers(n)) for n in SHAPE)
            tile = "r0_c0" if x < 18 else "r0_c1"
            near = np.array([z, y, x]) + rng.uniform(-0.45, 0.45, 3)
            near = np.clip(near, 0, np.array(SHAPE) - 1)
            assert value(port, f"{tile}/F", at_voxel(*near)) == counts()[z, y, x]
        # also where the tiles share a plane
        assert value(port, "r0_c0/F", at_voxel(3, 4, 18)) == counts()[3, 4, 18]


@pytest.mark.slow
def test_a_place_outside_the_volume_has_no_value(out: Path) -> None:
    with serving(out) as server:
        port = server.port
        for place, at in (
            ("r0_c0/F", at_voxel(3, 4, 20)),
            ("r0_c0/F", at_voxel(-1, 4, 3)),
            ("r0_c0/F", "1e300,0,0"),
            ("r9_c9/F", at_voxel(3, 4, 5)),
            ("r0_c0/G", at_voxel(3, 4, 5)),
            ("..%2f..%2fetc/F", at_voxel(3, 4, 5)),
        ):
            response, body = ask(port, f"/values/{place}?at={at}")
            assert (response.status, body) in ((200, b'{"value":null}'), (404, b"not found"))


@pytest.mark.parametrize("at", ["", "1,2", "1,2,3,4", "a,b,c", "nan,0,0", "inf,0,0", "1," * 200])
def test_a_malformed_position_is_refused(out: Path, at: str) -> None:
    assert parse_place(at) is None
    with serving(out) as server:
        port = server.port
        response, body = ask(port, f"/values/r0_c0/F?at={at}")
        assert (response.status, body) == (400, b"at: expected three numbers x,y,z in um")


@pytest.mark.slow
def test_a_stage_that_differs_from_the_bundle_s_gives_no_values(out: Path, tmp_path: Path) -> None:
    at = at_voxel(3, 4, 5)
    other = build(tmp_path, "--window", "F=-500:0")
    with serving(other) as server:
        port = server.port
        assert value(port, "r0_c0/F", at) == counts()[3, 4, 5]
    shutil.rmtree(other / "bundle")
    shutil.copytree(out / "bundle", other / "bundle")
    with serving(other) as server:
        port = server.port
        assert value(port, "r0_c0/F", at) is None


def test_a_bundle_without_a_stage_offers_no_values(out: Path, tmp_path: Path) -> None:
    with serving(shutil.copytree(out / "bundle", tmp_path / "alone")) as server:
        port = server.port
        response, _ = ask(port, "/manifest.json")
        assert "Stereocell-Values" not in response.headers
        response, _ = ask(port, f"/values/r0_c0/F?at={at_voxel(1, 1, 1)}")
        assert response.status == 404

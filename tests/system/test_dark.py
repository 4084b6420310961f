"""Structures that are darker than their surroundings, such as membranes in electron microscopy."""

from pathlib import Path

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray

from stereocell import read
from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.model.channel import Appearance
from stereocell.model.tiling import Box
from stereocell.transfer.opacity import evaluate

SHAPE = (20, 40, 40)
MEMBRANE, CYTOPLASM = 70, 170


def _membranes() -> NDArray[np.bool_]:
    """Return the faces, three voxels thick, between the cells of a Voronoi tessellation."""
    seeds = np.random.default_rng(1).uniform(0, 1, (9, 3)) * SHAPE
    places = np.stack(np.indices(SHAPE), -1)[..., None, :]
    away = np.sort(np.sqrt(((places - seeds) ** 2).sum(-1)), axis=-1)
    return np.asarray(away[..., 1] - away[..., 0] < 3)


@pytest.fixture(scope="module")
def tissue(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Write a micrograph of dark membranes, light cytoplasm and noise; return its path."""
    path = tmp_path_factory.mktemp("em") / "tissue.tif"
    noise = np.random.default_rng(2).normal(0, 8, SHAPE)
    voxels = (np.where(_membranes(), MEMBRANE, CYTOPLASM) + noise).round().astype(np.uint8)
    tifffile.imwrite(
        path,
        voxels,
        imagej=True,
        resolution=(125, 125),
        metadata={"spacing": 0.008, "unit": "um", "axes": "ZYX"},
    )
    return str(path)


def _built(tissue: str, out: Path, *words: str) -> Appearance:
    command = ["build", tissue, "-o", str(out), "--preset", "em", "--workers", "0", *words]
    assert main(command) == 0
    assert main(["check", str(out), "--deep"]) == 0
    (found,) = read_survey(OutFolder(out)).values()
    return found.appearance


@pytest.mark.parametrize(
    ("dtype", "stored", "inverted"),
    [
        (np.uint8, (0, 10, 255), (255, 245, 0)),
        (np.uint16, (0, 10, 65535), (65535, 65525, 0)),
        (np.int16, (-32768, 0, 32767), (32767, -1, -32768)),
        (np.float32, (-1.5, 0, 2), (1.5, 0, -2)),
    ],
)
def test_values_are_inverted_within_their_type(
    dtype: type[np.generic], stored: tuple[float, ...], inverted: tuple[float, ...], tmp_path: Path
) -> None:
    voxels = np.resize(np.array(stored, dtype), (3, 5, 4))
    path = tmp_path / "values.tif"
    tifffile.imwrite(path, voxels, photometric="minisblack", metadata={"axes": "ZYX"})
    dataset = read.open(path, dark=True, spacing_um=(1, 1, 1))
    found = dataset.read(0, Box((0, 0, 0), (3, 5, 4))).voxels
    assert found.dtype == dtype
    assert found.tolist() == np.resize(np.array(inverted, dtype), (3, 5, 4)).tolist()
    assert any("inverted" in note for note in dataset.notes)


def test_the_volume_of_an_electron_micrograph_shows_membranes(tissue: str, tmp_path: Path) -> None:
    look = _built(tissue, tmp_path / "out")
    assert look.iso_value is None
    assert "--surfaces" in look.surface_reason
    low, high = look.window
    opacities = evaluate(look.transfer_functions["default"])
    at = [round(255 * (255 - value - low) / (high - low)) for value in (MEMBRANE, CYTOPLASM)]
    assert opacities[at[0]] > 0.1
    assert opacities[at[1]] == 0


def test_surface_round_dark_structures_is_built_on_request(tissue: str, tmp_path: Path) -> None:
    look = _built(tissue, tmp_path / "out", "--surfaces", "0=outer")
    assert look.iso_value == pytest.approx(255 - (MEMBRANE + CYTOPLASM) / 2, abs=25)


def test_light_membranes_are_shown_without_inversion(tissue: str, tmp_path: Path) -> None:
    voxels = 255 - tifffile.imread(tissue)
    path = tmp_path / "light.tif"
    tifffile.imwrite(path, voxels, photometric="minisblack", metadata={"axes": "ZYX"})
    look = _built(str(path), tmp_path / "out", "--no-dark", "--spacing-um", ".008,.008,.008")
    dark = _built(tissue, tmp_path / "dark")
    assert look.window == dark.window


def test_a_channel_of_any_build_can_go_without_a_surface(tissue: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = ["build", tissue, "-o", str(out), "--workers", "0", "--surfaces", "0=none"]
    assert main(command) == 0
    (found,) = read_survey(OutFolder(out)).values()
    assert found.appearance.iso_value is None

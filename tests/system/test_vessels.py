"""The preset for vessels: a tree from a wide trunk to branches as thin as a voxel stays whole."""

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import ChannelSurvey, read_survey
from stereocell.building.vessel_levels import choose_connected
from stereocell.cli.__main__ import main
from stereocell.filters.denoise import denoise
from stereocell.isosurface.repair_rules import sum_components
from stereocell.model.volume import Volume

SHAPE = (40, 96, 96)
BLOOD, TISSUE, NOISE, BLUR = 400.0, 60.0, 6.0, 1.1  # voxel values; voxels


def _tree() -> tuple[NDArray[np.uint16], NDArray[np.int64]]:
    """Return an angiogram, and the voxels of its centre lines (n, 3).

    A trunk of 1.8 voxels' radius forks five times; each branch has 2^(-1/3) of its parent's radius,
    by Murray's law, so that the last ones are a voxel wide. They are spheres drawn on a finer grid.
    """
    rng = np.random.default_rng(8)
    fine = np.zeros(tuple(2 * n for n in SHAPE), np.float32)
    grid = np.indices((17, 17, 17)) - 8
    away = np.sqrt((grid**2).sum(0))
    centres = []

    def grow(
        place: NDArray[np.float64], way: NDArray[np.float64], radius: float, left: int
    ) -> None:
        for _ in range(14 if left < 5 else 18):
            place = place + way
            at = np.rint(2 * place).astype(int)
            if (at < 9).any() or (at + 9 >= fine.shape).any():
                return
            box = tuple(slice(k - 8, k + 9) for k in at)
            fine[box] = np.maximum(fine[box], away <= max(2 * radius, 0.8))
            centres.append(np.rint(place).astype(int))
        if left:
            aside = np.cross(way, rng.normal(size=3))
            aside /= np.linalg.norm(aside)
            for sign in (-1, 1):
                turned = way + 0.6 * sign * aside
                grow(place, turned / np.linalg.norm(turned), radius * 2 ** (-1 / 3), left - 1)

    grow(np.array([20.0, 6.0, 48.0]), np.array([0.0, 1.0, 0.0]), 1.8, 5)
    whole = fine.reshape(SHAPE[0], 2, SHAPE[1], 2, SHAPE[2], 2).mean((1, 3, 5))
    field = TISSUE + (BLOOD - TISSUE) * ndimage.gaussian_filter(whole, BLUR)
    voxels = np.clip(field + rng.normal(0, NOISE, SHAPE), 0, 65535).round().astype(np.uint16)
    return voxels, np.unique(np.array(centres), axis=0)


@pytest.fixture(scope="module")
def tree() -> tuple[NDArray[np.uint16], NDArray[np.int64]]:
    return _tree()


def _built(voxels: NDArray[np.uint16], folder: Path, preset: str) -> ChannelSurvey:
    path = folder / "tree.tif"
    tifffile.imwrite(
        path,
        voxels,
        imagej=True,
        resolution=(2, 2),
        metadata={"spacing": 0.5, "unit": "mm", "axes": "ZYX"},
    )
    out = folder / preset
    assert main(["plan", str(path), "-o", str(out), "--preset", preset]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    (found,) = read_survey(OutFolder(out)).values()
    return found


def _kept(
    voxels: NDArray[np.uint16], centres: NDArray[np.int64], found: ChannelSurvey
) -> tuple[float, float]:
    """Return the share of the tree's centre lines and of all voxels within the largest solid."""
    spacing = (500.0, 500.0, 500.0)
    level = found.appearance.level
    assert level is not None
    field = denoise(Volume(voxels, spacing), spacing[0], level.max_shift)
    under = 0.0 if level.background is None else float(level.background.values.mean())
    labels, _ = ndimage.label(field - under > level.iso, np.ones((3, 3, 3)))
    largest = 1 + int(np.bincount(labels.ravel())[1:].argmax())
    return float((labels[tuple(centres.T)] == largest).mean()), float((labels > 0).mean())


def test_thin_branches_stay_on_the_tree(
    tree: tuple[NDArray[np.uint16], NDArray[np.int64]], tmp_path: Path
) -> None:
    voxels, centres = tree
    vessels = _built(voxels, tmp_path, "vessels")
    kept, inside = _kept(voxels, centres, vessels)
    before, _ = _kept(voxels, centres, _built(voxels, tmp_path, "none"))
    assert vessels.appearance.surface == "clear"
    assert kept > 0.9
    assert before < kept - 0.1
    assert inside < 0.1


def _sums(*pairs: tuple[int, int]) -> list[dict[str, dict[str, int]]]:
    return [
        {"r0_c0": {"voxels": voxels, "main_voxels": voxels, "main_faces": faces}}
        for voxels, faces in pairs
    ]


def test_a_level_that_only_thickens_vessels_is_not_taken() -> None:
    # a tube of radius 4, 4.5 and 5 and the same length: surface grows with r, volume with r^2
    assert choose_connected(_sums((1600, 800), (2025, 900), (2500, 1000))) == 0


def test_a_level_that_adds_branches_is_taken_until_tissue_joins() -> None:
    assert choose_connected(_sums((1000, 900), (1100, 1100), (1250, 1350), (9000, 30000))) == 2


def test_pieces_that_hang_on_no_vessel_add_no_length() -> None:
    """A wide vessel with soft edges, in tissue that gets loose above each lower level."""
    rng = np.random.default_rng(4)
    _, y, x = np.indices((40, 64, 64))
    tube = ndimage.gaussian_filter((np.hypot(y - 32, x - 32) < 10).astype(float), 2.0)
    grain = ndimage.gaussian_filter(rng.normal(size=tube.shape), 1.0)
    field = 1000 * tube + 130 * grain / grain.std()
    sums = [sum_components(field > level, (1.0, 1.0, 1.0), 2.0) for level in (500, 425, 350, 300)]
    assert sums[-1].count > 10 * sums[0].count
    assert choose_connected([{"r0_c0": asdict(one)} for one in sums]) == 0

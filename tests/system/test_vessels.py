"""The preset for vessels keeps a tree whole, from a wide trunk to branches one voxel thin."""

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.filters.denoise import denoise
from stereocell.isosurface.repair_rules import sum_components
from stereocell.model.volume import Volume
from stereocell.planning.survey import ChannelSurvey
from stereocell.planning.vessel_levels import choose_connected

SHAPE = (40, 96, 96)
BLOOD, TISSUE, NOISE, BLUR = 400.0, 60.0, 6.0, 1.1  # voxel values; voxels


def _tree() -> tuple[NDArray[np.uint16], NDArray[np.int64]]:
    """Return an angiogram, and the voxels of its centre lines (n, 3).

    A trunk with a radius of 1.8 voxels forks five times. By Murray's law, a branch's radius is
    2^(-1/3) times its parent's, so the last branches are a voxel wide. Branches are drawn as
    spheres on a finer grid.
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
    """Return the shares of the centre lines and of all voxels that are in the largest solid."""
    spacing = (500.0, 500.0, 500.0)
    level = found.appearance.level
    assert level is not None
    field = denoise(Volume(voxels, spacing), spacing[0], level.max_shift)
    under = 0.0 if level.background is None else float(level.background.values.mean())
    labels, _ = ndimage.label(field - under > level.iso, np.ones((3, 3, 3)))
    largest = 1 + int(np.bincount(labels.ravel())[1:].argmax())
    return float((labels[tuple(centres.T)] == largest).mean()), float((labels > 0).mean())


def test_thin_branches_stay_connected_to_the_tree(
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


def _sums(*added: tuple[int, int, int, int]) -> list[dict[str, dict[str, int]]]:
    """Return the sums of one tile at each level, from the highest on.

    added  voxels at each level: of all components, of the main ones, of the new parts of these,
           and of the main ones that touch no main component of a higher level
    """
    names = ("voxels", "main_voxels", "new_voxels", "apart_voxels")
    return [{"r0_c0": dict(zip(names, one, strict=True))} for one in added]


def _tube(radius: float, length: int = 60) -> NDArray[np.bool_]:
    _, y, x = np.indices((70, 40, 40))
    tube = np.hypot(y - 20, x - 20) < radius
    tube[length:] = False
    return np.asarray(tube)


def _of(*masks: NDArray[np.bool_]) -> list[dict[str, dict[str, int]]]:
    pairs = zip((None, *masks), masks, strict=False)
    sums = [sum_components(now, (1.0, 1.0, 1.0), 2.0, higher=before) for before, now in pairs]
    return [{"r0_c0": asdict(one)} for one in sums]


def test_level_that_only_thickens_vessels_is_not_chosen() -> None:
    assert choose_connected(_of(_tube(4), _tube(4.8), _tube(5.5))) == 0


def test_a_branch_is_found_below_levels_that_only_thicken_vessels() -> None:
    branched = _tube(5.5)
    branched[20:22, 20, :18] = True
    assert choose_connected(_of(_tube(4), _tube(4.8), _tube(5.2), branched)) == 3


def test_levels_that_add_branches_are_chosen_until_tissue_joins() -> None:
    branches = (1000, 900, 0, 0), (1100, 1100, 50, 0), (1250, 1200, 40, 0)
    assert choose_connected(_sums(*branches, (9000, 8000, 5000, 0))) == 2


def test_tissue_that_appears_beside_vessels_ends_the_search() -> None:
    beside = _tube(5.2)
    beside[10:20, 2:8, 2:8] = True
    longer = _tube(5.2, 70) | beside
    assert choose_connected(_of(_tube(4), _tube(4.8), beside, longer)) == 0


def test_pieces_apart_from_vessels_do_not_count_as_branches() -> None:
    """A wide vessel with soft edges; at each lower level, separate pieces of tissue appear."""
    rng = np.random.default_rng(4)
    _, y, x = np.indices((40, 64, 64))
    tube = ndimage.gaussian_filter((np.hypot(y - 32, x - 32) < 10).astype(float), 2.0)
    grain = ndimage.gaussian_filter(rng.normal(size=tube.shape), 1.0)
    field = 1000 * tube + 130 * grain / grain.std()
    sums = _of(*(field > level for level in (500, 425, 350, 300)))
    assert sums[-1]["r0_c0"]["count"] > 10 * sums[0]["r0_c0"]["count"]
    assert choose_connected(sums) == 0

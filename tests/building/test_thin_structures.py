"""Plates and shells of one and two voxels in a CT whose preset has coarser planes."""

from pathlib import Path

import nibabel as nib
import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.filters.denoise import denoise
from stereocell.filters.noise import NoiseSample, find_max_shift
from stereocell.meshes.validity import find_defects
from stereocell.model.unit import Cover
from stereocell.model.volume import Volume
from stereocell.planning.settings import load as load_settings
from stereocell.steps.unit_files import cover_of, load_lods, load_record
from support.meshes import welded

SIDE, SPACING_MM = 64, 0.6
AIR, TISSUE, BONE = -1000.0, 40.0, 1200.0  # HU
WHOLE_SHELL = 4  # Euler characteristic of two spheres


def _head() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a ball of tissue in air, HU, and each voxel's distance from its centre."""
    z, y, x = np.ogrid[:SIDE, :SIDE, :SIDE]
    r = np.sqrt((z - 31.3) ** 2 + (y - 31.6) ** 2 + (x - 31.4) ** 2)
    return np.where(r < 29, TISSUE, AIR), r


def _shell(thickness: float) -> NDArray[np.float64]:
    head, r = _head()
    share = np.clip(thickness / 2 + 0.5 - np.abs(r - 22), 0, min(1.0, thickness))
    return head + share * (BONE - TISSUE)


def _plates(first: int) -> NDArray[np.float64]:
    head, _ = _head()
    head[first : first + 32 : 10, 16:48, 16:48] = BONE
    return head


def _built(folder: Path, voxels: NDArray[np.float64], *flags: str) -> OutFolder:
    noise = np.random.default_rng(0).normal(0, 10, voxels.shape)
    affine = np.diag([-SPACING_MM, -SPACING_MM, SPACING_MM, 1])
    image = nib.Nifti1Image((voxels + noise).round().astype(np.int16), affine)
    image.header.set_xyzt_units("mm")
    nib.save(image, folder / "ct.nii.gz")
    out = folder / "out"
    given = ("--preset", "ct-bone", "--grid", "2x1", *flags)
    assert main(["plan", str(folder / "ct.nii.gz"), "-o", str(out), *given]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    return OutFolder(out)


def _surface(folder: OutFolder) -> tuple[trimesh.Trimesh, Cover]:
    """Return the surface of all tiles as one mesh, and its cover of the source."""
    meshes, total = [], Cover(0, 0, 0)
    for name, key in folder.index().items():
        unit = folder.unit_dir(name, key)
        meshes.append(load_lods(unit)[0].mesh)
        cover = cover_of(load_record(unit))
        assert cover is not None
        total += cover
    assert len(meshes) == 2
    whole = welded(meshes)
    assert not find_defects(whole).total
    return trimesh.Trimesh(whole.positions, whole.triangles), total


@pytest.mark.slow
@pytest.mark.parametrize("thickness", [1.0, 1.5, 2.0])
def test_a_shell_of_one_to_two_voxels_stays_closed(tmp_path: Path, thickness: float) -> None:
    surface, cover = _surface(_built(tmp_path, _shell(thickness)))
    assert surface.euler_number == WHOLE_SHELL
    assert len(surface.split(only_watertight=True)) == 2
    assert cover.missing < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("first", [16, 17])
def test_plates_of_one_voxel_stay_on_any_plane(
    tmp_path: Path, first: int, capsys: pytest.CaptureFixture[str]
) -> None:
    surface, cover = _surface(_built(tmp_path, _plates(first)))
    assert len(surface.split(only_watertight=True)) == 4
    assert cover.missing < 0.07  # the rest is voxels at the plates' edges
    printed = " ".join(capsys.readouterr().err.split())
    assert "too thin for planes 1400 um apart (surface.grid_um)" in printed
    assert "all planes carry its surface" in printed


@pytest.mark.parametrize("preset", ["ct", "ct-bone"])
def test_thin_bone_in_noisy_coarse_voxels_passes_the_filters_of_ct_presets(preset: str) -> None:
    """Lines one voxel wide, 200 to 900 HU above tissue, look like ribs in voxels of 3 mm."""
    rng = np.random.default_rng(0)
    voxels = np.full((24, 96, 96), TISSUE)
    for column in range(6, 92, 5):
        z = np.clip(np.cumsum(rng.integers(-1, 2, 80)) + rng.integers(6, 18), 2, 21)
        voxels[z, np.arange(8, 88), column] = TISSUE + rng.uniform(200, 900, 80)
    voxels += rng.normal(0, 29, voxels.shape)
    sample = NoiseSample()
    sample.add(voxels)
    surface = load_settings(preset, None, flags={}).surface
    shift = find_max_shift(sample.deviation(), surface.max_shift, None)
    found = denoise(Volume(voxels.astype(np.float32), (3000.0, 3000.0, 3000.0)), 3000.0, shift)
    bone = voxels > 300
    assert bone.sum() > 1000
    assert (found > 300)[bone].mean() > 0.95


@pytest.mark.slow
def test_planes_of_the_preset_carry_a_solid_that_is_nowhere_thin(tmp_path: Path) -> None:
    folder = _built(tmp_path, _head()[0], "--iso-value", "*=-300")
    plan = folder.plan()
    (survey,) = read_survey(folder).values()
    assert plan.with_grid(survey.grid_um).step == (2, 2, 2)
    assert survey.thin_share < 0.01
    assert survey.thinning(plan) == ""
    surface, cover = _surface(folder)
    assert surface.euler_number == 2
    assert cover.missing < 0.05

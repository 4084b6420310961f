"""The work of a unit is bounded by its voxels: fewer planes carry a noisy surface."""

from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.meshes.validity import find_defects
from stereocell.model.mesh import Mesh
from stereocell.steps.unit_files import load_lods
from support import phantoms
from support.meshes import welded

SPACING = (0.6, 0.3, 0.3)
SHAPE = (24, 64, 128)  # two tiles
MAX_FACES = 6000


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build a sponge, whose surface is like noise's, and a ball that lies in both tiles."""
    folder = tmp_path_factory.mktemp("frayed")
    noise = np.random.default_rng(3).normal(0, 1, SHAPE)
    sponge = 1000 + 4000 * ndimage.gaussian_filter(noise, (0.5, 1, 1))
    z, y, x = np.ogrid[[slice(n) for n in SHAPE]]
    r = np.sqrt(((z - 12) * 0.6) ** 2 + ((y - 32) * 0.3) ** 2 + ((x - 64) * 0.3) ** 2)
    ball = 100 + 900 / (1 + np.exp(4 * (r - 5)))
    voxels = np.stack([np.clip(sponge, 0, None), ball]).astype(np.uint16)
    source, out = folder / "scene.ome.tif", folder / "out"
    phantoms.write_ome_tiff(source, voxels, spacing=SPACING, axes="CZYX", names=["sponge", "ball"])
    (folder / "settings.toml").write_text(f"[surface]\nmax_faces = {MAX_FACES}\n")
    flags = ["--tile-size", "24,64,64", "--config", str(folder / "settings.toml")]
    given = ["--iso-value", "sponge=1000", "--iso-value", "ball=500"]
    assert main(["plan", str(source), "-o", str(out), *flags, *given]) == 0
    return out


@pytest.mark.slow
def test_fewer_planes_carry_the_surface_of_a_sponge_and_a_note_says_so(
    out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["units", str(out), "--workers", "0"]) == 0
    printed = " ".join(capsys.readouterr().err.split())
    folder = OutFolder(out)
    plan, survey = folder.plan(), read_survey(folder)
    step = plan.with_grid(survey["sponge"].grid_um).step
    assert "one plane in {}, {}, {} along z, y, x carries its surface".format(*step) in printed
    assert survey["sponge"].most_faces > MAX_FACES
    assert step[1] > step[0] >= 1  # nearly the same distance along all axes
    assert survey["ball"].grid_um == 0
    assert "ball: up to" not in printed
    assert f"{MAX_FACES:,} (surface.max_faces)" in survey["sponge"].thinning(plan)


@pytest.mark.slow
@pytest.mark.parametrize("channel", ["sponge", "ball"])
def test_tiles_of_a_sponge_make_one_valid_surface_with_few_enough_triangles(
    out: Path, channel: str
) -> None:
    assert main(["units", str(out), "--workers", "0"]) == 0
    folder = OutFolder(out)
    index = folder.index()
    meshes: list[Mesh] = []
    for tile in folder.plan().tiles:
        unit = folder.unit_dir(f"{tile.id}/{channel}", index[f"{tile.id}/{channel}"])
        meshes.append(load_lods(unit)[0].mesh)
    assert len(meshes) == 2
    for mesh in meshes:
        # each crossed voxel edge has a vertex, and each vertex two triangles
        assert len(mesh.triangles) <= 2 * MAX_FACES
    assert not find_defects(welded(meshes)).total

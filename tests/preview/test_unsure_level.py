"""`iso` calls a level unsure if a build with the same settings does."""

from pathlib import Path

import numpy as np
import pytest

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.planning.settings import load
from stereocell.preview import iso_value
from stereocell.preview.iso_value import preview, table
from support import nifti_files, phantoms

SHAPE, SPACING = (20, 40, 60), (1.0, 1.0, 1.0)


@pytest.fixture(autouse=True)
def _small_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(iso_value, "_LONGEST_PX", 90)


@pytest.mark.parametrize(
    ("top", "noise", "surface"), [(1100, 10.0, "clear"), (250, 40.0, "unsure")]
)
def test_a_level_is_unsure_in_the_table_as_in_a_build(
    tmp_path: Path, top: int, noise: float, surface: str
) -> None:
    balls = [phantoms.blurred_ball(SHAPE, SPACING, (10.0, 20.0, x), 8.0, 1.0) for x in (14.0, 44.0)]
    source = tmp_path / "balls.ome.tif"
    counts = phantoms.as_counts(balls[0] + balls[1], 200, top, noise=noise)
    phantoms.write_ome_tiff(source, counts, spacing=SPACING)
    out = tmp_path / "out"
    assert main(["plan", str(source), "-o", str(out), "--grid", "1x1"]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    (built,) = read_survey(OutFolder(out)).values()
    assert built.appearance.surface == surface
    settings = load(None, None, flags={"plan": {"grid": "1x1"}})
    result, _ = preview(
        str(source), "0", tile_id="r0_c0", out=tmp_path / "a.png", settings=settings
    )
    (chosen,) = (one for one in result.candidates if one.is_chosen)
    assert chosen.confidence == pytest.approx(built.appearance.iso_confidence)
    assert ("calls it unsure: " in table(result)[-1]) == (surface == "unsure")


def test_the_standard_level_of_bone_has_no_confidence(tmp_path: Path) -> None:
    _, y, x = np.indices(SHAPE)
    away = np.hypot(y - 20, x - 30)
    hu = np.select([away < 2, away < 15], [700, 40], -1000)
    hu = hu + np.random.default_rng(0).normal(0, 8, SHAPE).round().astype(int)
    affine = np.diag([3.0, 3.0, 3.0, 1.0])
    voxels = hu.astype(np.int16).transpose(2, 1, 0)
    source = nifti_files.write(tmp_path / "ct.nii.gz", affine, voxels)
    result, _ = preview(
        str(source),
        "0",
        tile_id="r0_c0",
        out=tmp_path / "a.png",
        settings=load("ct-bone", None, flags={}),
    )
    chosen = result.candidates[0]
    assert (chosen.name, chosen.level, chosen.confidence) == ("given", 300, None)
    assert "unsure" not in table(result)[-1]

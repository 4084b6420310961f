"""A stage and its exports look alike, and right, in the programs that open them.

Storm draws by the stage's own lights alone, Blender in its default scene, the add-on as it leaves
the scene after an import, three.js by the same lights as the stage's, Cesium by its own. A small
stage is drawn here. `make test-dcc` draws the samples, larger, and writes a contact sheet.
"""

import os
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import pytest

from support.blender_session import NEEDS_BLENDER
from support.dcc.measures import overlap
from support.dcc.pictures import BY_DEFAULT_CAMERA, COLUMNS, EEVEE, VOLUMES, Picture, draw_pictures
from support.dcc.sheet import write_sheet
from support.stages import write_whole

# The samples: NAME=OUT, separated by spaces. Empty: the letter F of support/stages.py
SAMPLES = dict(one.split("=") for one in os.environ.get("STEREOCELL_DCC", "").split())
SHEET = os.environ.get("STEREOCELL_DCC_SHEET")
# EEVEE compiles its shaders for a minute, so the small stage is drawn without it
CHOSEN = [one for one in COLUMNS if SAMPLES or one != EEVEE]
SIZE = (640, 360) if SAMPLES else (240, 135)
LUMINANCE = (0.15, 0.7)  # of encoded values from 0 to 1
# A .glb brings no light. Blender's default lamp leaves fronts in the shade: its own grey cube has a
# luminance of .20 from the front, and .43 from the default camera, by which a .glb is judged
UNLIT = "Blender, glb"
HUE_DEGREES = 10
OVERLAP = 0.95
HAS_CHROMIUM = Path(os.environ.get("CHROMIUM") or "/usr/bin/chromium").exists()
pytestmark = [
    *NEEDS_BLENDER,
    pytest.mark.skipif(not HAS_CHROMIUM and not os.environ.get("CI"), reason="needs Chromium"),
]

Pictures = dict[str, Picture]


@pytest.fixture(scope="module")
def drawn() -> Iterator[dict[str, Pictures]]:
    """Pictures of each sample; their contact sheet is written at the end."""
    samples: dict[str, Pictures] = {}
    yield samples
    if SHEET:
        write_sheet(Path(SHEET), samples)


@pytest.fixture(scope="module", params=list(SAMPLES) or ["F"])
def pictures(
    request: pytest.FixtureRequest,
    drawn: dict[str, Pictures],
    tmp_path_factory: pytest.TempPathFactory,
) -> Pictures:
    folder = tmp_path_factory.mktemp(request.param)
    if request.param in SAMPLES:
        stage = (Path(SAMPLES[request.param]) / "stage/stage.usda").resolve()
    else:
        stage = write_whole(folder / "stage")
    drawn[request.param] = draw_pictures(stage, folder, SIZE, CHOSEN)
    return drawn[request.param]


@pytest.mark.parametrize("column", [one for one in CHOSEN if one != UNLIT])
def test_the_specimen_is_neither_dark_nor_overexposed(pictures: Pictures, column: str) -> None:
    found = pictures[column].measures
    assert LUMINANCE[0] <= found.luminance <= LUMINANCE[1]
    assert found.white < 0.02  # no more than highlights


@pytest.mark.parametrize("column", CHOSEN)
def test_each_channel_has_the_hue_of_its_colour(pictures: Pictures, column: str) -> None:
    hues = pictures[column].measures.hues
    assert {name: hue for name, hue in hues.items() if hue > HUE_DEGREES} == {}


def test_three_draws_in_the_light_of_the_stage_as_storm_does(pictures: Pictures) -> None:
    """Materials and lights mean the same to both."""
    storm, three = (pictures[column].measures for column in ("Storm, stage", "three, glb"))
    assert three.luminance == pytest.approx(storm.luminance, abs=0.04)


def test_all_programs_draw_the_same_silhouette(pictures: Pictures) -> None:
    """Volumes are left out: their haze, below the surface's level, reaches past the bodies.

    Where there is none, they fit at an alpha of 0.1: .97 of the sample cycif, .99 of mri. In sparse
    cells of a light sheet, haze covers as much again as the cells do: .62 of brain-cells.
    """
    surfaces = [column for column in CHOSEN if column not in (VOLUMES, BY_DEFAULT_CAMERA)]
    for column in surfaces:
        assert pictures[column].measures.silhouette > OVERLAP, column
    for one, other in combinations(surfaces, 2):
        assert overlap(pictures[one].drawn, pictures[other].drawn) > OVERLAP, (one, other)

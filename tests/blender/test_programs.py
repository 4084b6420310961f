"""A stage and its exports look right, and the same, in all programs that open them.

The programs differ in their lights. Storm and three.js use the stage's lights, and Cesium uses its
own. Blender is tested in its default scene, and in the scene that the add-on makes.

These tests draw a small stage. `make test-dcc` draws the samples at a larger size and writes a
contact sheet.
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

# Samples to draw: NAME=OUT, separated by spaces. Without any, the F of support/stages.py is drawn.
SAMPLES = dict(one.split("=") for one in os.environ.get("STEREOCELL_DCC", "").split())
SHEET = os.environ.get("STEREOCELL_DCC_SHEET")
# The small stage is not drawn with EEVEE, which compiles its shaders for a minute.
CHOSEN = [one for one in COLUMNS if SAMPLES or one != EEVEE]
SIZE = (640, 360) if SAMPLES else (240, 135)
LUMINANCE = (0.15, 0.7)  # 0..1; allowed range of the mean of encoded values
# The luminance of this column is not checked. A .glb has no light, and the front is in the shade of
# Blender's default lamp. Blender's own grey cube has a luminance of .20 from the front and .43 from
# the default camera. A .glb's luminance is therefore checked in the view of the default camera.
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
    """Yield a dictionary for the images of each sample; write the contact sheet at the end."""
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
    assert found.white < 0.02  # only highlights may be white


@pytest.mark.parametrize("column", CHOSEN)
def test_each_channel_has_the_hue_of_its_colour(pictures: Pictures, column: str) -> None:
    hues = pictures[column].measures.hues
    assert {name: hue for name, hue in hues.items() if hue > HUE_DEGREES} == {}


def test_three_draws_in_the_light_of_the_stage_as_storm_does(pictures: Pictures) -> None:
    """Both Storm and three interpret materials and lights in the same way."""
    storm, three = (pictures[column].measures for column in ("Storm, stage", "three, glb"))
    assert three.luminance == pytest.approx(storm.luminance, abs=0.04)


def test_all_programs_draw_the_same_silhouette(pictures: Pictures) -> None:
    """All columns of surfaces overlap; volumes are not compared.

    Volumes also show haze: voxels below the level of the surface, which reach beyond it. Volumes
    with little haze overlap the surfaces at an alpha of 0.1: .97 for the sample cycif, .99 for mri.
    In brain-cells, haze covers as much area as the sparse cells do, and the overlap is .62.
    """
    surfaces = [column for column in CHOSEN if column not in (VOLUMES, BY_DEFAULT_CAMERA)]
    for column in surfaces:
        assert pictures[column].measures.silhouette > OVERLAP, column
    for one, other in combinations(surfaces, 2):
        assert overlap(pictures[one].drawn, pictures[other].drawn) > OVERLAP, (one, other)

"""A channel without a clear surface: built all the same, smoothed, flagged wherever it shows."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd
from scipy import ndimage

from stereocell.building.out_folder import OutFolder
from stereocell.building.plan import smoothed_plan
from stereocell.cli.__main__ import main
from stereocell.filters.denoise import SMOOTHING_REACH
from stereocell.report.facts import gather
from stereocell.report.remarks import find_remarks
from support import phantoms
from support.plans import choose

SPACING = (1.0, 1.0, 1.0)
SHAPE = (24, 40, 80)
VERDICTS = {"ball": "clear", "noise": "unclear", "flat": "none"}


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two tiles of: a ball in the left one, noise without structure, one value."""
    rng = np.random.default_rng(0)
    ball = phantoms.blurred_ball(SHAPE, SPACING, (12.0, 20.0, 20.0), 8.0, 1.0)
    noise = ndimage.gaussian_filter(rng.normal(size=SHAPE), 1.0)
    channels = np.stack(
        [
            phantoms.as_counts(ball, 100, 1100, noise=10.0),
            np.rint(1000 + 200 * noise / noise.std()).astype(np.uint16),
            np.full(SHAPE, 7, np.uint16),
        ]
    )
    folder = tmp_path_factory.mktemp("unclear")
    source = phantoms.write_ome_zarr(
        folder / "three.ome.zarr",
        [channels],
        "czyx",
        scales=[{"c": 1.0, **dict.fromkeys("zyx", 1.0)}],
        channels=[{"label": name, "color": "FFFFFF"} for name in VERDICTS],
    )
    flags = ["-o", str(folder / "out"), "--tile-size", "24,40,40", "--workers", "0"]
    assert main(["build", str(source), *flags]) == 0
    return folder / "out"


def _looks(out: Path) -> Iterator[tuple[str, str, float]]:
    for entry in OutFolder(out).survey().values():
        appearance = entry["appearance"]
        yield appearance["name"], appearance["surface"], appearance["iso_confidence"]


def test_clearness_follows_the_confidence(out: Path) -> None:
    least = OutFolder(out).plan().settings.isovalue.min_confidence
    found = {name: (surface, confidence) for name, surface, confidence in _looks(out)}
    assert {name: surface for name, (surface, _) in found.items()} == VERDICTS
    assert found["ball"][1] > 2 * least
    assert found["noise"][1] < least / 2
    assert found["flat"][1] == 0


def test_stage_and_manifest_say_so_and_the_unclear_surface_is_there(out: Path) -> None:
    stage = Usd.Stage.Open(str(out / "stage" / "stage.usda"))
    manifest = json.loads((out / "bundle" / "manifest.json").read_text())
    for channel in manifest["channels"]:
        surface_confidence = VERDICTS[channel["name"]]
        prim = stage.GetPrimAtPath(f"/Specimen/Channels/{channel['id']}")
        assert prim.GetAttribute("stereocell:surfaceVerdict").Get() == surface_confidence
        assert channel["surface"] == surface_confidence
        assert (channel["tileset"] is None) == (surface_confidence == "none")


def _edit(out: Path, path: Path, surface_confidence: str) -> Path:
    stage = out / "stage" / "stage.usda"
    path.write_text(f"""#usda 1.0
(
    defaultPrim = "Specimen"
    metersPerUnit = 1e-6
    upAxis = "Y"
    subLayers = [@{stage}@]
)
over "Specimen"
{{
    over "Channels"
    {{
        over "noise"
        {{
            token stereocell:surfaceVerdict = "{surface_confidence}"
        }}
    }}
}}
""")
    return path


def test_a_bundle_follows_a_surface_confidence_that_was_edited(out: Path, tmp_path: Path) -> None:
    edit = _edit(out, tmp_path / "edit.usda", "clear")
    assert main(["bundle", str(out), "--stage", str(edit), "--workers", "0"]) == 0
    manifest = json.loads((out / "bundle" / "manifest.json").read_text())
    assert [channel["surface"] for channel in manifest["channels"]] == ["clear", "clear", "none"]


def test_a_surface_confidence_that_is_none_is_named(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    edit = _edit(out, tmp_path / "edit.usda", "perhaps")
    assert main(["bundle", str(out), "--stage", str(edit), "--workers", "0"]) == 1
    assert "surfaceVerdict: 'perhaps', expected one of clear, unclear, none" in (
        capsys.readouterr().err
    )


def test_the_report_tells_it_of_the_channel_and_not_of_every_tile(out: Path) -> None:
    remarks = {remark.title: remark.lines for remark in find_remarks(gather(OutFolder(out)))}
    (line,) = remarks["1 channel with no clear surface"]
    assert line.startswith("noise: confidence 0.0")
    assert line.endswith(
        "expected at least 0.4; built all the same, at the levels found, and smoothed"
    )
    told = [line for lines in remarks.values() for line in lines if "/noise" in line]
    assert told == []
    assert "no clear surface</b>: built all the same" in (out / "report/index.html").read_text()


def test_smoothed_surface_reads_no_more_voxels_and_the_halo_holds(out: Path) -> None:
    plan = OutFolder(out).plan()
    assert smoothed_plan(plan, "clear") is plan
    smoothed = smoothed_plan(plan, "unclear")
    before, after = plan.settings.surface, smoothed.settings.surface
    assert float(after.smoothing_um) > 2 * float(before.smoothing_um)
    assert choose(plan, "unclear", []).alpha_um == 0
    reaches = [
        choose(plan, surface_confidence, []).reach_um(plan.spacing_um)
        + SMOOTHING_REACH * float(surface.smoothing_um)
        for surface_confidence, surface in (("clear", before), ("unclear", after))
    ]
    assert reaches[1] == pytest.approx(reaches[0])
    assert smoothed.halo == plan.halo

"""A channel whose surface would wrap the specimen is drawn as a volume only beside others."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.report.facts import gather
from stereocell.report.remarks import find_remarks
from stereocell.steps.unit_files import load_lods
from support import phantoms

SHAPE = (24, 48, 48)


def _source(path: Path, **channels: NDArray[np.float64]) -> Path:
    """Write channels of 100 to 1000 counts, with noise."""
    noise = np.random.default_rng(0).normal(0, 8, SHAPE)
    voxels = np.stack([100 + 900 * one + noise for one in channels.values()])
    return phantoms.write_ome_zarr(
        path,
        [voxels.round().astype(np.uint16)],
        "czyx",
        scales=[{"z": 1.0, "y": 1.0, "x": 1.0}],
        channels=[{"label": name} for name in channels],
    )


def _ball(radius: float) -> NDArray[np.float64]:
    """Return a ball in the middle, 0..1."""
    return phantoms.blurred_ball(SHAPE, (1.0, 1.0, 1.0), (11.5, 23.5, 23.5), radius, 1.0)


def _slab() -> NDArray[np.float64]:
    """Return a tissue that fills all but a margin of the block: 62 % of it."""
    slab = np.zeros(SHAPE)
    slab[2:22, 4:44, 4:44] = 1.0
    return slab


def _triangles(source: Path, out: Path, *flags: str) -> dict[str, int]:
    assert main(["plan", str(source), "--out", str(out), *flags]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    folder = OutFolder(out)
    return {
        unit.split("/")[1]: sum(len(lod.mesh.triangles) for lod in load_lods(place)[:1])
        for unit, key in folder.index().items()
        for place in [folder.unit_dir(unit, key)]
    }


def test_a_channel_that_covers_the_others_is_drawn_as_a_volume(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = (
        _source(tmp_path / "two.ome.zarr", haze=_slab(), cells=_ball(6.0)),
        tmp_path / "out",
    )
    triangles = _triangles(source, out)
    assert triangles["haze"] == 0
    assert triangles["cells"] > 100
    survey = read_survey(OutFolder(out))
    assert {id_: one.appearance.surface for id_, one in survey.items()} == {
        "haze": "none",
        "cells": "clear",
    }
    found = re.findall(r"haze: drawn as a volume: .*", capsys.readouterr().err)
    assert len(found) == 1
    share = re.search(r"would hold (\d+)% of the specimen", found[0])
    assert share is not None
    assert int(share[1]) == pytest.approx(100 * _slab().mean(), abs=3)
    assert "--surfaces haze=outer" in found[0]
    remarks = [text for one in find_remarks(gather(OutFolder(out))) for text in one.lines]
    assert any(text.startswith("haze: drawn as a volume") for text in remarks)


def test_the_surface_of_a_covering_channel_is_built_on_request(tmp_path: Path) -> None:
    source = _source(tmp_path / "two.ome.zarr", haze=_slab(), cells=_ball(6.0))
    asked = _triangles(source, tmp_path / "asked", "--surfaces", "haze=outer")
    stated = _triangles(source, tmp_path / "stated", "--iso-value", "haze=550")
    assert min(asked.values()) > 100
    assert min(stated.values()) > 100


def test_channels_that_all_cover_keep_their_surfaces(tmp_path: Path) -> None:
    source = _source(tmp_path / "both.ome.zarr", a=_slab(), b=_slab())
    assert min(_triangles(source, tmp_path / "out").values()) > 100


def test_a_single_channel_keeps_its_surface(tmp_path: Path) -> None:
    source = _source(tmp_path / "one.ome.zarr", haze=_slab())
    assert min(_triangles(source, tmp_path / "out").values()) > 100

"""The first view of a source is a bundle: coarse, with the positions and windows of a build."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from numpy.typing import NDArray

from stereocell.cli.__main__ import main
from stereocell.formats.ktx2 import decode_finest
from stereocell.live import coarse_channel, first_view
from stereocell.live.coarse_channel import read_coarse
from stereocell.planning.input_files import as_asked
from stereocell.planning.plan import Plan
from stereocell.planning.preset_choice import load_for
from stereocell.planning.settle import settle
from stereocell.planning.survey_steps import window_step
from stereocell.read import Dataset
from stereocell.steps.open_source import open_source
from stereocell.usd.composed_appearance import StatedLevel
from support.phantoms import f_phantom, write_ome_tiff, write_ome_zarr


def write_view_of(source: Path, root: Path, **flags: dict[str, Any]) -> Plan:
    plan, dataset = planned(source, **flags)
    first_view.write_first_view(plan, first_view.read_channels(plan, dataset), root)
    return plan


def planned(source: Path, **flags: dict[str, Any]) -> tuple[Plan, Dataset]:
    settings, choice = load_for(source, None, None, flags=flags)
    plan = settle(str(source), settings, choice)
    return plan, open_source(as_asked(plan.source, plan.settings.plan))


def manifest_of(root: Path) -> dict[str, Any]:
    return dict(json.loads((root / "manifest.json").read_text()))


def volumes_of(root: Path, channel: dict[str, Any]) -> list[dict[str, Any]]:
    return list(json.loads((root / channel["volumes"]["path"]).read_text())["volumes"])


@pytest.fixture
def f_tiff(tmp_path: Path) -> Path:
    """The letter F of 32 x 96 x 72 voxels, (z, y, x), 1 x 0.5 x 0.5 um apart."""
    return write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(2), spacing=(1.0, 0.5, 0.5))


def test_coarse_voxels_lie_where_the_source_has_them(
    f_tiff: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(first_view, "VOXELS", 16_000)
    root = tmp_path / "view"
    plan = write_view_of(f_tiff, root, plan={"tile_size": (32, 48, 40)})
    (channel,) = manifest_of(root)["channels"]
    entries = volumes_of(root, channel)
    assert [entry["tile"] for entry in entries] == [tile.id for tile in plan.tiles]
    assert len(entries) == 4
    low, high = channel["window"]
    fine = np.clip((f_phantom(2).astype(float) - low) / (high - low), 0, 1) * 255
    seen: list[NDArray[np.float64]] = []
    true: list[NDArray[np.float64]] = []
    for entry in entries:
        voxels = decode_finest((root / entry["file"]["path"]).read_bytes())[..., 0]
        # place of each texel inside the apron, um; the world's y points up, its z to the viewer
        corners = zip(
            entry["bounds_um"]["min"], entry["bounds_um"]["max"], entry["size"], strict=True
        )
        x, y, z = (np.linspace(a, b, n - 2) for a, b, n in corners)
        rows, columns, planes = -y[::-1] / 0.5, x / 0.5, -z[::-1] / 1.0
        grid = np.meshgrid(planes, rows, columns, indexing="ij")
        nearest = tuple(np.rint(along).astype(int) for along in grid)
        seen.append(voxels[1:-1, 1:-1, 1:-1].ravel().astype(float))
        true.append(fine[nearest].ravel())
    assert np.corrcoef(np.concatenate(seen), np.concatenate(true))[0, 1] > 0.9


def test_a_first_view_passes_the_checks_of_a_bundle(
    f_tiff: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = tmp_path / "view"
    write_view_of(f_tiff, root)
    assert main(["check", str(root)]) == 0
    manifest = manifest_of(root)
    (channel,) = manifest["channels"]
    assert channel["tileset"] is None
    assert (channel["surface"], channel["surface_reason"]) == ("none", first_view.NOT_BUILT)
    assert [tile["unfinished"] for tile in manifest["tiles"]] == [True]


def test_windows_and_level_are_near_those_of_a_build(f_tiff: Path, tmp_path: Path) -> None:
    root = tmp_path / "view"
    plan = write_view_of(f_tiff, root)
    (channel,) = manifest_of(root)["channels"]
    statistics = window_step(plan, plan.channels[0]).run().statistics
    low, high = statistics.window
    assert channel["window"] == pytest.approx([low, high], abs=0.02 * (high - low))
    background, body = float(f_phantom().min()), float(f_phantom().max())
    assert channel["iso_value"] == pytest.approx((background + body) / 2, rel=0.15)
    # The largest gradient of the joint histogram, by which 2D functions tell edges from tissue
    functions = json.loads((root / channel["transfer_functions_2d"]["file"]["path"]).read_text())
    steepest = statistics.suggested.transfer_2d.gradient_max
    assert functions["gradient_max"] == pytest.approx(steepest, rel=0.02)


def test_a_large_source_is_read_at_a_coarse_level(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(coarse_channel, "READ_VOXELS", 20_000)
    fine = f_phantom(2)
    coarse = np.full((16, 48, 36), 7777, np.uint16)  # its value shows which level was read
    source = write_ome_zarr(
        tmp_path / "large.ome.zarr",
        [fine, coarse],
        scales=[dict.fromkeys("zyx", 1.0), dict.fromkeys("zyx", 2.0)],
        translations=[None, dict.fromkeys("zyx", 0.5)],
    )
    plan, dataset = planned(source)
    read = read_coarse(dataset, plan, plan.channels[0], 2_000)
    assert (read.voxels == 7777).all()
    assert read.voxels.size <= 2_000


def test_only_some_planes_of_a_large_source_without_a_pyramid_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(coarse_channel, "READ_VOXELS", 40_000)
    source = write_ome_zarr(
        tmp_path / "deep.ome.zarr",
        [f_phantom(2)],
        chunks=(1, 96, 72),
        scales=[{"z": 1.0, "y": 1.0, "x": 1.0}],
    )
    plan, dataset = planned(source)
    read: list[int] = []
    plain = Dataset.read

    def counting(self: Dataset, channel: int, box: Any, level: int = 0) -> Any:
        read.append(int(np.prod(box.shape)))
        return plain(self, channel, box, level)

    monkeypatch.setattr(Dataset, "read", counting)
    found = read_coarse(dataset, plan, plan.channels[0], 500)
    assert sum(read) <= 1.5 * 40_000 < f_phantom(2).size
    # the middle of the first block: 8 voxels along each axis
    assert found.grid.first == pytest.approx([(step - 1) / 2 for step in found.grid.step])


def test_voxels_between_coarse_ones_are_interpolated_and_continue_at_the_ends(
    tmp_path: Path,
) -> None:
    # a ramp along x; the chequers, of mean 1, keep it from looking like a label map
    z, y, x = np.indices((16, 64, 64))
    ramp = (10 * x + 2 * ((x + y + z) % 2)).astype(np.uint16)
    source = write_ome_tiff(tmp_path / "ramp.ome.tif", ramp, spacing=(1.0, 1.0, 1.0))
    plan, dataset = planned(source)
    read = read_coarse(dataset, plan, plan.channels[0], 16 * 64 * 64 // 64)
    assert read.grid.step == (4.0, 4.0, 4.0)
    places = (np.array([2.0]), np.array([30.0]), np.array([-3.0, 10.0, 11.5, 70.0]))
    assert read.at(places).ravel().tolist() == [16.0, 101.0, 116.0, 616.0]


def test_a_source_without_channels_of_its_own_is_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    group = zarr.open_group(tmp_path / "no.ome.zarr", mode="w")
    group.attrs["ome"] = {"version": "0.5"}
    assert main(["view", str(tmp_path / "no.ome.zarr"), "--port", "0", "--no-browser"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("stereocell: ")
    assert str(tmp_path / "no.ome.zarr") in line


def test_objects_of_a_label_map_show_as_a_volume_with_lines_between_them(tmp_path: Path) -> None:
    labels = np.zeros((8, 24, 40), np.uint16)
    labels[2:7, 4:20, 4:20], labels[2:7, 4:20, 20:36] = 3, 7
    source = write_ome_tiff(tmp_path / "cells.ome.tif", labels, spacing=(1.0, 1.0, 1.0))
    root = tmp_path / "view"
    plan = write_view_of(source, root, labels={".": "."})
    assert main(["check", str(root)]) == 0
    (channel,) = manifest_of(root)["channels"]
    assert (channel["id"], channel["surface"]) == (plan.labels[0].id, "none")
    assert channel["surface_reason"] == first_view.OBJECTS_NOT_BUILT
    assert channel["color"] == pytest.approx(plan.labels[0].color)
    (entry,) = volumes_of(root, channel)
    voxels = decode_finest((root / entry["file"]["path"]).read_bytes())[1:-1, 1:-1, 1:-1, 0]
    assert (voxels[labels == 0] == 0).all()
    assert (voxels[labels > 0] > 0).all()
    # between the two objects a plane is fainter than what lies on either side
    row = voxels[4, 12]
    assert row[19] < row[18] == row[20] == 255


def test_numbers_of_a_label_map_are_never_averaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(first_view, "VOXELS", 10_000)
    # halves of 10 and 30: their mean is 20, which is no object, and air round them
    labels = np.zeros((40, 40, 80), np.uint16)
    labels[8:32, 8:32, 8:40], labels[8:32, 8:32, 40:72] = 10, 30
    source = write_ome_tiff(tmp_path / "halves.ome.tif", labels, spacing=(1.0, 1.0, 1.0))
    plan, dataset = planned(source, labels={".": "."})
    (coarse,) = first_view.read_channels(plan, dataset).values()
    assert coarse.voxels.size <= 10_000 < labels.size
    assert coarse.voxels.max() == 1
    assert coarse.voxels[0].max() == 0


def test_a_translucent_channel_looks_like_its_surface_where_voxels_are_those_of_the_build(
    f_tiff: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = []
    for voxels in (4_000_000, 10_000):
        monkeypatch.setattr(first_view, "VOXELS", voxels)
        root = tmp_path / f"view-{voxels}"
        write_view_of(f_tiff, root)
        opened.append(manifest_of(root)["channels"][0]["transfer_function"])
    assert opened == ["surface", "sharp"]


def test_coarse_voxels_stay_translucent_where_the_surface_lies_above_a_background(
    f_tiff: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(first_view, "VOXELS", 10_000)
    plan, dataset = planned(f_tiff)
    (channel,) = plan.channels
    coarse = first_view.read_channels(plan, dataset)[channel.voxels_id]
    found = first_view.composed(first_view.first_appearance(plan, channel, coarse)[0])
    assert first_view.as_surface(found, coarse, 1.0).chosen == "sharp"
    uneven = replace(found, level=StatedLevel(100.0, (20.0, 400.0), 0.0))
    assert first_view.as_surface(uneven, coarse, 1.0).chosen == "soft"

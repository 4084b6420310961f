"""The share of a source that has been read is counted, and printed if reading takes long."""

from pathlib import Path

import pytest

from stereocell.live import coarse_channel, first_view, reading
from stereocell.live.reading import Reading
from stereocell.planning.input_files import as_asked
from stereocell.planning.preset_choice import load_for
from stereocell.planning.settle import settle
from stereocell.steps.open_source import open_source
from support.phantoms import f_phantom, write_ome_tiff


def test_the_parts_of_all_channels_are_the_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(first_view, "VOXELS", 10_000)
    monkeypatch.setattr(coarse_channel, "SLAB_VOXELS", 50_000)
    source = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(2), spacing=(1.0, 0.5, 0.5))
    settings, choice = load_for(source, None, None, flags={})
    plan = settle(str(source), settings, choice)
    counted = Reading(lambda _: None)
    shares: list[float] = []

    def count(share: float) -> None:
        counted.add(share)
        shares.append(counted.share)

    dataset = open_source(as_asked(plan.source, plan.settings.plan))
    first_view.read_channels(plan, dataset, count)
    assert len(shares) > 3
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1)


def test_a_line_is_printed_from_time_to_time(monkeypatch: pytest.MonkeyPatch) -> None:
    now = iter([0.0, 1.0, 3.5, 4.0, 7.0])
    monkeypatch.setattr(reading.time, "monotonic", lambda: next(now))
    lines: list[str] = []
    counted = Reading(lines.append)
    for _ in range(4):
        counted.add(0.2)
    assert lines == ["reading the source: 40%", "reading the source: 80%"]

"""A build opens each source once, unless its files change."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tifffile

from stereocell.planning import input_files
from stereocell.steps import open_source
from stereocell.steps.open_source import SourceRef


def test_units_use_the_source_that_the_plan_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, opened = tmp_path / "a.tif", []
    original = open_source.open_afresh
    monkeypatch.setattr(
        open_source, "open_afresh", lambda ref: [opened.append(ref), original(ref)][1]
    )

    def write(value: int) -> None:
        tifffile.imwrite(path, np.full((5, 6, 7), value, np.uint16), photometric="minisblack")

    def plan() -> SourceRef:
        ref = SourceRef(str(path), 0, (1.0, 1.0, 1.0))
        return replace(ref, fingerprint=input_files.reopen(ref).fingerprint)

    input_files.forget()
    write(1)
    ref = plan()
    assert input_files.open_watched(ref).fingerprint == ref.fingerprint
    assert len(opened) == 1
    write(2)
    changed = plan()
    assert changed.fingerprint != ref.fingerprint
    assert input_files.open_watched(changed).fingerprint == changed.fingerprint
    assert len(opened) == 2
    assert input_files.open_watched(ref).fingerprint == changed.fingerprint  # it is reported
    input_files.forget()


def test_two_sources_stay_open_side_by_side(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[SourceRef] = []
    original = open_source.open_afresh
    monkeypatch.setattr(
        open_source, "open_afresh", lambda ref: [opened.append(ref), original(ref)][1]
    )
    input_files.forget()
    refs = []
    for name in ("image", "labels"):
        path = tmp_path / f"{name}.tif"
        tifffile.imwrite(path, np.ones((5, 6, 7), np.uint16), photometric="minisblack")
        ref = SourceRef(str(path), 0, (1.0, 1.0, 1.0))
        refs.append(replace(ref, fingerprint=input_files.reopen(ref).fingerprint))
    for _ in range(3):
        for ref in refs:
            assert input_files.open_watched(ref).fingerprint == ref.fingerprint
    assert len(opened) == 2
    input_files.forget()

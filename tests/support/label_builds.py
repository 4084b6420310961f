"""Builds of label maps by the command, and what their bundles state of the objects."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.cli.__main__ import main

PHASES = ("plan", "units", "stage", "bundle")


def run(*arguments: object) -> int:
    return main([str(argument) for argument in arguments])


def build(source: Path, out: Path, *flags: object) -> None:
    assert run("plan", source, "-o", out, *flags) == 0
    for phase in PHASES[1:]:
        assert run(phase, out, "--workers", 0) == 0


def printed(capsys: pytest.CaptureFixture[str]) -> str:
    return "".join(capsys.readouterr())


def objects_of(out: Path, name: str = "cells") -> Any:
    return json.loads((out / f"bundle/channels/{name}/objects.json").read_text("utf-8"))


def column_of(out: Path, column_id: str, name: str = "cells") -> NDArray[np.float32]:
    entry = next(one for one in objects_of(out, name)["columns"] if one["id"] == column_id)
    return np.fromfile(out / "bundle" / entry["exact"]["path"], np.dtype("<f4"))


def labels_of(out: Path, name: str = "cells") -> NDArray[np.uint32]:
    return np.fromfile(out / "bundle" / objects_of(out, name)["labels"]["path"], np.dtype("<u4"))


def boxes(*spans: tuple[int, ...], shape: tuple[int, int, int]) -> NDArray[np.uint16]:
    """Return a label map of boxes that are 10 voxels long along z and 16 along y.

    spans  label, first x and last x + 1 of each box, in voxels
    """
    labels = np.zeros(shape, np.uint16)
    for label, start, stop in spans:
        labels[3:13, 4:20, start:stop] = label
    return labels

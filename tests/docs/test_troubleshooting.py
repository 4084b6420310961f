"""Each line that docs/troubleshooting.md quotes is printed by a command that fails so."""

import re
import shutil
import socket
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile

from stereocell.cli.__main__ import main
from stereocell.serve.server import LOCALHOST
from support import phantoms

PAGE = Path(__file__).parents[2] / "docs" / "troubleshooting.md"
# Quoted lines that other tests provoke: they need an extra that is missing, a full disk or a lock
PROVOKED_ELSEWHERE = {"stereocell[", "can't be written: No space left", "is writing here"}


def quoted(section: str) -> set[str]:
    """Return the parts of lines that a section quotes."""
    text = PAGE.read_text("utf-8").partition(f"## {section}\n")[2].partition("\n## ")[0]
    cells = re.findall(r"^\| (`.*?) \|", text, re.MULTILINE)
    return {part for cell in cells for part in re.findall(r"`([^`]+)`", cell)}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with sources that are each wrong in one way, and a build."""
    place = tmp_path_factory.mktemp("wrong")
    rng = np.random.default_rng(0)
    spaced = {"axes": "ZYX", "spacing": 0.5, "unit": "um"}

    def write(name: str, voxels: Any, **more: Any) -> None:
        tifffile.imwrite(place / name, voxels, **more)

    imagej = {"imagej": True, "resolution": (5.0, 5.0), "metadata": spaced}
    write("plain.tif", rng.integers(0, 400, (12, 40, 40)).astype(np.uint16))
    write("noise.tif", rng.normal(400, 30, (16, 48, 48)).astype(np.float32), **imagej)
    write("plane.tif", rng.integers(0, 400, (40, 40)).astype(np.uint16))
    numbers = np.arange(1, 76).reshape(3, 5, 5).astype(np.uint16) * 37 % 997
    write("labels.tif", numbers.repeat(4, 0).repeat(8, 1).repeat(8, 2), **imagej)
    (place / "page.tif").write_text("<!doctype html><html>")
    whole = (place / "noise.tif").read_bytes()
    (place / "cut.tif").write_bytes(whole[: len(whole) // 2])
    (place / "mine").mkdir()
    (place / "mine" / "notes.txt").write_text("mine")
    phantoms.write_ome_tiff(place / "f.ome.tif", phantoms.f_phantom(), "ZYX")
    phantoms.write_ome_tiff(place / "other.ome.tif", phantoms.f_phantom()[:, :, ::-1], "ZYX")
    assert main(["plan", str(place / "f.ome.tif"), "-o", str(place / "planned")]) == 0
    shutil.copytree(place / "planned", place / "edited")
    plan = place / "edited" / "plan.json"
    plan.write_text(plan.read_text("utf-8").replace('"level": 0', '"level": 1'), "utf-8")
    return place


def _printed(capsys: pytest.CaptureFixture[str], arguments: Sequence[object]) -> str:
    capsys.readouterr()
    main([str(one) for one in arguments])
    answer = capsys.readouterr()
    return " ".join((answer.out + answer.err).split())


def test_each_quoted_line_is_printed(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def plan(name: str, *flags: str, out: Path = tmp_path / "out") -> list[object]:
        return ["plan", folder / name, "-o", out, *flags]

    provoked: dict[str, list[object]] = {
        "voxel size: not found with a unit of length": plan("plain.tif"),
        "looks like a label map": plan("labels.tif"),
        "one plane (2D)": plan("plane.tif"),
        "found an HTML page": plan("page.tif"),
        "cut short at byte": plan("cut.tif"),
        "not found, expected a file or a folder": plan("nothing.tif"),
        "the source holds no channel names": plan("noise.tif", "--channels", "CD31"),
        "no surface: ": plan("noise.tif", out=tmp_path / "noise"),
        "holds a build of": plan("other.ome.tif", out=folder / "planned"),
        "holds something else": plan("f.ome.tif", out=folder / "mine"),
        "damaged or changed by hand": ["units", folder / "edited"],
        "not built for the plan": ["stage", folder / "planned"],
        "is missing: run": ["bundle", tmp_path / "nothing"],
        "is unknown, expected one of": plan("f.ome.tif", "--preset", "cyclic"),
        "expected three numbers z,y,x": plan("f.ome.tif", "--spacing-um", "1,2"),
        "expected a name that ends in": ["export", folder / "planned", tmp_path / "cells.abc"],
    }
    sections = ("The source", "The folder OUT", "Settings")
    assert {part for each in sections for part in quoted(each)} == set(provoked) | (
        PROVOKED_ELSEWHERE
    )
    for part, arguments in provoked.items():
        assert part.strip() in _printed(capsys, arguments), part


def test_a_taken_port_is_named_with_its_flag(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = PAGE.read_text("utf-8")
    assert "`port 8000: Address already in use`" in page
    assert "`--port 8001`" in page
    with socket.socket() as taken:
        taken.bind((LOCALHOST, 0))
        taken.listen()
        port = taken.getsockname()[1]
        printed = _printed(
            capsys, ["view", folder / "f.ome.tif", "--no-browser", "--no-build", "--port", port]
        )
    assert f"port {port}: Address already in use" in printed
    assert "--port" in printed

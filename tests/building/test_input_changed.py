"""An input that changes while tasks read it is reported in one line, and no result is kept."""

import os
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import tifffile
import zarr
from numpy.typing import NDArray

from stereocell.building import run_on_input
from stereocell.cli.__main__ import main
from stereocell.model.unit import Unit
from stereocell.objects.extents import Extents
from stereocell.planning import input_files
from stereocell.read import fingerprint
from stereocell.read import tables as tables_module
from stereocell.steps.find_extents import FindExtents
from stereocell.steps.learn_tissue import LearnTissue
from stereocell.steps.open_source import SourceRef, open_afresh
from stereocell.steps.tissue_files import TissueClasses
from stereocell.steps.unit_files import UnitFolder
from stereocell.storage import file_states
from stereocell.storage.file_states import FileStates
from stereocell.storage.location import Location
from support import phantoms
from support.digests import digests_of
from support.onnx_models import write_model

BODY = phantoms.f_phantom()
OTHER = np.ascontiguousarray(BODY[:, ::-1])
INLINE = ["--workers", "0"]
GRID = ["--grid", "2x1"]
UM = ["--spacing-um", "0.5,0.2,0.2"]


@pytest.fixture(autouse=True)
def fresh() -> None:
    """Forget the inputs of earlier tests, like a new process."""
    input_files.forget()


def write_tiff(path: Path, voxels: NDArray[np.uint16]) -> Path:
    return phantoms.write_ome_tiff(path / "f.ome.tif", voxels, "ZYX")


def write_zarr(path: Path, voxels: NDArray[np.uint16]) -> Path:
    return phantoms.write_ome_zarr(path / "f.ome.zarr", [voxels], chunks=(8, 24, 18))


def write_planes(path: Path, voxels: NDArray[np.uint16]) -> Path:
    (path / "planes").mkdir(exist_ok=True)
    for z, plane in enumerate(voxels):
        tifffile.imwrite(path / "planes" / f"z{z:02d}.tif", plane)
    return path / "planes"


SOURCES = {"TIFF": write_tiff, "OME-Zarr": write_zarr, "planes": write_planes}


def after_the_first_unit(monkeypatch: pytest.MonkeyPatch, change: Callable[[], object]) -> None:
    """Call `change` once, between the first unit and the second."""
    left, write = [change], UnitFolder.write

    def write_and_change(form: UnitFolder, place: Path, result: Unit) -> None:
        write(form, place, result)
        if left:
            left.pop()()

    monkeypatch.setattr(UnitFolder, "write", write_and_change)


def units_of(out: Path) -> dict[str, str]:
    """Return the digests of all units' files, except records of times and of the input's path."""
    found = digests_of(out / "units")
    left_out = ("seconds.json", "plan.key")
    return {name: sha for name, sha in found.items() if not name.endswith(left_out)}


def built(source: Path, out: Path, *flags: str) -> dict[str, str]:
    """Build an undisturbed input, and return the digests of its units."""
    input_files.forget()
    assert main(["plan", str(source), "-o", str(out), *GRID, *flags]) == 0
    assert main(["units", str(out), *INLINE]) == 0
    return units_of(out)


def last_line(capsys: pytest.CaptureFixture[str]) -> str:
    return capsys.readouterr().err.strip().splitlines()[-1]


@pytest.mark.parametrize("name", SOURCES)
def test_an_image_that_changes_while_units_are_built_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    write, out = SOURCES[name], tmp_path / "out"
    source = write(tmp_path, BODY)
    flags = UM if name == "planes" else []
    assert main(["plan", str(source), "-o", str(out), *GRID, *flags]) == 0
    after_the_first_unit(monkeypatch, lambda: write(tmp_path, OTHER))
    assert main(["units", str(out), *INLINE]) == 1
    line = last_line(capsys)
    assert "changed while it was read" in line
    assert "plan into another OUT" in line
    assert not list(out.rglob("unit.json"))


def test_after_a_change_the_old_and_the_new_input_are_built_as_if_undisturbed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, out = write_zarr(tmp_path, BODY), tmp_path / "out"
    undisturbed = built(source, tmp_path / "undisturbed")
    assert main(["plan", str(source), "-o", str(out), *GRID]) == 0
    with monkeypatch.context() as patch:
        after_the_first_unit(patch, lambda: write_zarr(tmp_path, OTHER))
        assert main(["units", str(out), *INLINE]) == 1
    (tmp_path / "apart").mkdir()
    expected = built(write_zarr(tmp_path / "apart", OTHER), tmp_path / "expected")
    assert built(source, tmp_path / "other") == expected
    write_zarr(tmp_path, BODY)
    input_files.forget()
    assert main(["units", str(out), *INLINE]) == 0
    assert units_of(out) == undisturbed


def test_a_label_map_that_changes_while_units_are_built_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = write_tiff(tmp_path, BODY), tmp_path / "out"
    labels = tmp_path / "cells.ome.tif"
    numbers = (BODY > 500).astype(np.uint16)
    phantoms.write_ome_tiff(labels, numbers, "ZYX")
    plan = ["plan", str(source), "-o", str(out), *GRID, "--labels", f"cells={labels}"]
    assert main(plan) == 0
    after_the_first_unit(monkeypatch, lambda: phantoms.write_ome_tiff(labels, numbers * 2, "ZYX"))
    assert main(["units", str(out), *INLINE]) == 1
    assert "labels 'cells': changed while it was read" in last_line(capsys)
    assert not list(out.rglob("unit.json"))


def test_a_change_while_objects_are_located_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = write_tiff(tmp_path, (BODY > 500).astype(np.uint16)), tmp_path / "out"
    assert main(["plan", str(source), "-o", str(out), "--labels", "."]) == 0
    find = FindExtents.run

    def run(step: FindExtents) -> Extents:
        found = find(step)
        write_tiff(tmp_path, (OTHER > 500).astype(np.uint16))
        return found

    monkeypatch.setattr(FindExtents, "run", run)
    assert main(["units", str(out), *INLINE]) == 1
    assert "changed while it was read" in last_line(capsys)
    assert not list(out.rglob("extents-*"))


@pytest.mark.parametrize("name", SOURCES)
def test_files_that_are_written_again_with_the_same_voxels_are_accepted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    write, out = SOURCES[name], tmp_path / "out"
    source = write(tmp_path, BODY)
    flags = UM if name == "planes" else []
    assert main(["plan", str(source), "-o", str(out), *GRID, *flags]) == 0

    def rewrite() -> None:
        """Write every file again: a TIFF may be packed otherwise, all others get the same bytes."""
        write(tmp_path, BODY)
        for file in tmp_path.rglob("*"):
            if out not in file.parents:
                os.utime(file)

    after_the_first_unit(monkeypatch, rewrite)
    assert main(["units", str(out), *INLINE]) == 0


@pytest.fixture
def sampled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Callable[[], None]]:
    """An image whose fingerprint covers a sample, and a function that changes another chunk."""
    monkeypatch.setattr(fingerprint, "BUDGET_BYTES", 10_000)
    monkeypatch.setattr(file_states, "MAX_READ_BYTES", 10_000)
    source = write_zarr(tmp_path, BODY)
    array = zarr.open_group(source)["0"]
    assert isinstance(array, zarr.Array)
    ref = SourceRef(str(source), 0, ())
    before = open_afresh(ref).fingerprint
    for z, y, x in np.ndindex(2, 2, 2):
        box = np.s_[8 * z : 8 * z + 8, 24 * y : 24 * y + 24, 18 * x : 18 * x + 18]
        held = array[box]
        array[box] = 0
        is_seen = open_afresh(ref).fingerprint != before
        array[box] = held
        if not is_seen:
            return source, partial(array.__setitem__, box, 0)
    raise AssertionError("the fingerprint covers all chunks")


AS_IMAGE = ["--as", "intensity"]


def test_all_units_are_built_again_if_a_chunk_outside_of_the_fingerprint_s_sample_changes(
    sampled: tuple[Path, Callable[[], None]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The fingerprint is the same, so results of the old voxels would pass for the new ones."""
    source, change = sampled
    out = tmp_path / "out"
    assert main(["plan", str(source), "-o", str(out), *GRID, *AS_IMAGE]) == 0
    with monkeypatch.context() as patch:
        after_the_first_unit(patch, change)
        assert main(["units", str(out), *INLINE]) == 1
    line = last_line(capsys)
    assert "the first is '0/c/" in line
    assert f"no unit is kept: run `stereocell units {out}` again" in line
    assert main(["units", str(out), *INLINE]) == 0
    assert units_of(out) == built(source, tmp_path / "expected", *AS_IMAGE)


@pytest.mark.parametrize("is_changed", [True, False])
def test_last_results_of_a_killed_command_are_made_again_if_the_input_was_written_since(
    sampled: tuple[Path, Callable[[], None]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    is_changed: bool,
) -> None:
    source, change = sampled
    out = tmp_path / "out"
    assert main(["plan", str(source), "-o", str(out), *GRID, *AS_IMAGE]) == 0

    def die() -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:  # a killed process does not clean up
        after_the_first_unit(patch, die)
        patch.setattr(run_on_input, "_require_still", lambda *_, **__: None)
        assert main(["units", str(out), *INLINE]) != 0
    assert len(list(out.rglob("unit.json"))) == 1
    assert (out / "running.json").is_file()
    if is_changed:
        change()
    input_files.forget()
    capsys.readouterr()
    assert main(["units", str(out), *INLINE]) == 0
    printed = capsys.readouterr().err
    assert ("are built again" in printed) == is_changed
    assert f"units: {2 if is_changed else 1}/{2 if is_changed else 1}" in printed
    assert not (out / "running.json").exists()


def test_a_task_that_fails_because_the_input_changed_is_reported_as_a_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = write_zarr(tmp_path, BODY), tmp_path / "out"
    assert main(["plan", str(source), "-o", str(out), *GRID]) == 0
    after_the_first_unit(monkeypatch, lambda: shutil.rmtree(source))
    assert main(["units", str(out), *INLINE]) == 1
    assert "changed while it was read" in last_line(capsys)


def planned_with_table(folder: Path) -> tuple[Path, Path]:
    """Plan a label map with a table; return OUT and the table."""
    source, out = write_tiff(folder, (BODY > 500).astype(np.uint16)), folder / "out"
    table = folder / "cells.csv"
    table.write_text("label,kind\n1,first\n")
    plan = ["plan", str(source), "-o", str(out), "--labels", ".", "--table", str(table)]
    assert main(plan) == 0
    return out, table


def test_a_table_that_changes_while_it_is_read_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out, table = planned_with_table(tmp_path)
    assert main(["units", str(out), *INLINE]) == 0
    read = tables_module._read

    def change(*arguments: object) -> object:
        found = read(*arguments)  # type: ignore[arg-type]
        table.write_text("label,kind\n1,second one\n")
        return found

    with monkeypatch.context() as patch:
        patch.setattr(tables_module, "_read", change)
        assert main(["stage", str(out), *INLINE]) == 1
    line = last_line(capsys)
    assert "cells.csv: changed while it was read" in line
    assert "run the same command again" in line
    assert main(["stage", str(out), *INLINE]) == 0
    assert b"second one" in b"".join(
        file.read_bytes() for file in (out / "stage").rglob("*.usd*") if file.suffix != ".usdz"
    )


def test_a_table_that_changes_while_units_are_built_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out, table = planned_with_table(tmp_path)
    with monkeypatch.context() as patch:
        after_the_first_unit(patch, lambda: table.write_text("label,kind\n1,second\n"))
        assert main(["units", str(out), *INLINE]) == 1
    line = last_line(capsys)
    assert "cells.csv: changed since it was planned" in line
    assert "run the same command again" in line
    # units don't depend on the table, so they are kept
    assert main(["units", str(out), *INLINE]) == 0
    assert "units: up to date" in capsys.readouterr().err


@pytest.mark.parametrize("changes", ["model", "image"])
def test_a_model_or_its_image_that_changes_while_it_is_read_is_reported(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    changes: str,
) -> None:
    source, out = write_tiff(tmp_path, BODY), tmp_path / "out"
    model = write_model(tmp_path / "m.onnx")
    assert main(["plan", str(source), "-o", str(out)]) == 0
    if changes == "model":
        read = Path.read_bytes

        def read_bytes(path: Path) -> bytes:
            found = read(path)
            if path == model:
                write_model(model, slopes=(1.0, 2.0, 3.0))
            return found

        monkeypatch.setattr(Path, "read_bytes", read_bytes)
    else:
        learn = LearnTissue.run

        def learn_and_change(step: LearnTissue) -> TissueClasses:
            found = learn(step)
            write_tiff(tmp_path, OTHER)
            return found

        monkeypatch.setattr(LearnTissue, "run", learn_and_change)
    assert main(["tissue", str(out), "--model", str(model)]) == 1
    line = last_line(capsys)
    assert "changed while it was read" in line
    assert f"run `stereocell tissue {out}` again" in line
    assert not (out / "tissue").exists()


def test_a_store_that_permits_no_listing_is_compared_only_by_its_fingerprint(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(*_: object) -> object:
        raise PermissionError("Access Denied")

    monkeypatch.setattr(file_states, "_stored", refuse)
    states = FileStates.look(
        Location.of("memory://public.ome.zarr"), ["memory://public.ome.zarr/0"]
    )
    assert not states.is_complete
    assert states.changed() == []


def test_many_files_are_listed_and_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in range(3000):
        (tmp_path / f"{number}").write_bytes(b"voxels")
    read: list[str] = []
    monkeypatch.setattr(file_states, "_digest", lambda path: read.append(path) or "")
    states = FileStates.look(Location.of(tmp_path), [str(tmp_path)])
    assert len(states.states) == 3000
    assert states.changed() == []
    assert read == []
    (tmp_path / "77").write_bytes(b"other voxels")
    (tmp_path / "78").unlink()
    (tmp_path / "new").write_bytes(b"")
    assert [Path(path).name for path in states.changed()] == ["77", "78", "new"]

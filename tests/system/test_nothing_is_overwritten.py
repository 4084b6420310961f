"""Commands that write never replace foreign files. Such a file stays, and one line names it."""

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from stereocell import samples
from stereocell.cli.__main__ import main
from stereocell.cli.places import PLACES
from stereocell.export.endings import TAKES
from support.digests import digests_of
from support.error_lines import error_line
from support.outputs import make_build, make_source

Given = Callable[[Path, Path, Path], list[object]]  # source, its build, the place of the result
SAMPLES = {"cycif": ".ome.zarr", "cells": ".ome.zarr", "brain-cells": ".ome.tif", "mri": ""}
WORK = b"years of work"


def _writing(name: str) -> dict[str, tuple[str, Given]]:
    """Return by name the trials of a command that writes.

    A trial has the ending of the result's name, and a function that returns the command's words.
    """
    if name in ("build", "plan"):
        return {name: ("", lambda source, _, place: [name, source, "-o", place])}
    if name == "slices":
        return {name: ("", lambda source, _, place: [name, source, "-o", place])}
    if name == "iso":
        more = ["--channel", "F", "--tile", "r0_c0"]
        return {name: (".png", lambda source, _, place: [name, source, "-o", place, *more])}
    if name == "sample":
        small = {"cycif": ["--grid", "1x1", "--tile-size", "8,16,16"]}
        return {
            f"sample {one}": (
                ending,
                lambda _s, _b, place, one=one: [name, one, place, *small.get(one, [])],
            )
            for one, ending in SAMPLES.items()
        }
    if name == "export":
        return {
            f"export {ending}": (ending, lambda _, build, place: [name, build, place])
            for ending in TAKES
        }
    if name == "publish":
        return {name: ("", lambda _, build, place: [name, build, place])}
    return {name: ("", lambda _s, _b, place: [name, place])}  # the command writes into the build


TRIALS = {
    trial: given
    for name, places in PLACES.items()
    if places.writes
    for trial, given in _writing(name).items()
}
# --force does not replace a file by a folder, or a folder by a picture
NOT_FORCED = {("build", "a file"), ("plan", "a file"), ("publish", "a file")}
NOT_FORCED |= {("iso", "a folder"), ("iso", "another build")}
OF_A_BUILD = {name for name, places in PLACES.items() if places.writes == "out" and places.reads}


# The functions with which the commands' work begins. A guard must come before each of them.
BEGINNINGS = (
    "building.phases.remove_mixed",
    "steps.write_stage_tile.WriteStageTile.run",
    "building.tissue._learn",
    "steps.write_bundle.opened_stage",
    "export.write.Chosen",
    "export.export_build.write_scene",
    "preview.iso_value.window_step",
    "preview.png_slices.cut_planes",
    "publish.publish._require_whole",
    "report.page.write_report",
    "samples.brain_cells.replacing",
    "samples.cells.make_tissue",
    "samples.cycif.grow_tissue",
    "samples.head_dicom.make_head",
)


# These commands open the source first, because only its fingerprint identifies a foreign build.
OPENINGS = (
    "building.phases.settle",
    "planning.preset_choice.open_source",
    "preview.iso_value.settle",
)


@pytest.fixture
def few_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the sample `cells` with few cells, because all 300 take seconds."""
    few = partial(samples.write_cells, shape=(12, 30, 30))
    monkeypatch.setattr(samples, "write_cells", few)


@pytest.fixture(scope="module")
def builds(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A build of one specimen, and one of another."""
    folder = tmp_path_factory.mktemp("builds")
    pair = [
        make_source(folder / f"{name}.ome.tif", lift=lift) for name, lift in (("f", 0), ("g", 9))
    ]
    one, other = (make_build(source, source.parent / source.name[0]) for source in pair)
    return one, other


def _lay(kind: str, place: Path, other: Path) -> None:
    if kind == "a file":
        place.write_bytes(WORK)
    elif kind == "a folder":
        place.mkdir()
        (place / "thesis.tex").write_bytes(WORK)
    else:
        shutil.copytree(other, place)


def _run(trial: str, builds: tuple[Path, Path], place: Path, *more: str) -> int:
    one, _ = builds
    source = one.parent / "f.ome.tif"
    words = TRIALS[trial][1](source, one, place)
    return main([*(str(word) for word in words), *more])


@pytest.mark.parametrize(
    ("trial", "kind"),
    [
        (trial, kind)
        for trial in TRIALS
        for kind in ("a file", "a folder", "another build")
        if kind != "another build" or trial not in OF_A_BUILD  # commands on a build go on with it
    ],
)
def test_foreign_file_stays_and_is_named_before_any_work(
    builds: tuple[Path, Path],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    trial: str,
    kind: str,
) -> None:
    def begin(*_: object, **__: object) -> None:
        pytest.fail("the work began before the place was refused")

    is_build = kind == "another build" and trial in ("build", "plan")
    for name in (*BEGINNINGS, *(() if is_build else OPENINGS)):
        monkeypatch.setattr(f"stereocell.{name}", begin)
    place = tmp_path / f"mine{TRIALS[trial][0]}"
    _lay(kind, place, builds[1])
    before = digests_of(tmp_path)
    capfd.readouterr()
    assert _run(trial, builds, place) == 1
    line = error_line(capfd)
    assert str(place) in line
    assert "expected" in line or "choose another OUT" in line
    assert ("--force" in line) == (trial not in OF_A_BUILD and (trial, kind) not in NOT_FORCED)
    assert digests_of(tmp_path) == before


@pytest.mark.usefixtures("few_cells")
@pytest.mark.parametrize("kind", ["a file", "a folder"])
@pytest.mark.parametrize("trial", ["iso", "slices", "export .stl", "sample mri", "sample cells"])
def test_force_replaces_foreign_files_and_is_in_the_help(
    builds: tuple[Path, Path],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    trial: str,
    kind: str,
) -> None:
    place = tmp_path / f"mine{TRIALS[trial][0]}"
    _lay(kind, place, builds[1])
    assert _run(trial, builds, place, "--force") == ((trial, kind) in NOT_FORCED)
    if (trial, kind) in NOT_FORCED:
        return
    assert WORK not in [file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()]
    with pytest.raises(SystemExit):
        main([trial.split()[0], "--help"])
    assert "--force" in capfd.readouterr().out


@pytest.mark.usefixtures("few_cells")
@pytest.mark.parametrize("name", ["mine.csv", "mine.ome.zarr", "mine.truth.json"])
def test_a_file_at_the_place_of_any_part_of_a_sample_stays(tmp_path: Path, name: str) -> None:
    sample = "cycif" if "truth" in name else "cells"
    small = ["--grid", "1x1", "--tile-size", "8,16,16"] if sample == "cycif" else []
    (tmp_path / name).write_bytes(WORK)
    assert main(["sample", sample, str(tmp_path / "mine.ome.zarr"), *small]) == 1
    assert [file.read_bytes() for file in tmp_path.rglob("*")] == [WORK]
    (tmp_path / name).unlink()
    for _ in range(2):  # the second time, the place exists
        assert main(["sample", sample, str(tmp_path / "mine.ome.zarr"), *small]) == 0
    assert {file.name for file in tmp_path.iterdir()} == {
        "mine.ome.zarr",
        "mine.truth.json" if sample == "cycif" else "mine.csv",
    }


@pytest.mark.parametrize(
    ("name", "ending", "work"),
    [
        ("cycif", ".ome.zarr", "cycif.grow_tissue"),
        ("cells", ".ome.zarr", "cells.make_tissue"),
        ("mri", "", "head_dicom.make_head"),
    ],
)
@pytest.mark.usefixtures("few_cells")
def test_sample_of_another_seed_is_refused_before_it_is_made(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    ending: str,
    work: str,
) -> None:
    words = [name, str(tmp_path / f"mine{ending}")]
    words += ["--grid", "1x1", "--tile-size", "8,16,16"] if name == "cycif" else []
    assert main(["sample", *words]) == 0
    before = digests_of(tmp_path)
    capfd.readouterr()
    monkeypatch.setattr(f"stereocell.samples.{work}", lambda *_, **__: pytest.fail("it is made"))
    assert main(["sample", *words, "--seed", "7"]) == 1
    assert "expected nothing or the same sample" in error_line(capfd)
    assert digests_of(tmp_path) == before


@pytest.mark.parametrize("more", [[], ["--unity"]])
def test_text_beside_exported_voxels_is_guarded_before_the_work(
    builds: tuple[Path, Path],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    more: list[str],
) -> None:
    words = ["export", str(builds[0]), str(tmp_path / "mine.raw"), *more]
    assert main(words) == 0
    (beside,) = {file.name for file in tmp_path.iterdir()} - {"mine.raw"}
    (tmp_path / "mine.raw").unlink()
    (tmp_path / beside).write_bytes(WORK)
    monkeypatch.setattr("stereocell.export.write.Chosen", lambda *_: pytest.fail("it is made"))
    assert main(words) == 1
    assert beside in error_line(capfd)
    assert (tmp_path / beside).read_bytes() == WORK


def test_tissue_is_not_learned_if_the_bundle_is_foreign(
    builds: tuple[Path, Path],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = Path(shutil.copytree(builds[0], tmp_path / "out"))
    (out / "bundle" / "thesis.tex").write_bytes(WORK)
    before = digests_of(out)
    monkeypatch.setattr("stereocell.building.tissue._learn", lambda *_: pytest.fail("it learns"))
    assert main(["tissue", str(out), "--classes", "2"]) == 1
    assert "thesis.tex" in error_line(capfd)
    assert digests_of(out) == before

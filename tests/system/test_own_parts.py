"""A build goes on only in its own OUT. It keeps results of another input and foreign files."""

import shutil
from pathlib import Path

import pytest
from pxr import Sdf

import stereocell
from stereocell.cli.__main__ import main
from stereocell.model.errors import OutputError
from stereocell.verify.formats import check
from support.digests import digests_of
from support.error_lines import error_line
from support.outputs import make_build, make_source

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("without_node")]

WORK = "years of work"
FLAGS = ["--workers", "0"]


@pytest.fixture(scope="module")
def builds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of two specimens, f and g, and their builds."""
    folder = tmp_path_factory.mktemp("builds")
    for name, lift in (("f", 0), ("g", 9)):
        make_build(make_source(folder / f"{name}.ome.tif", lift=lift), folder / name)
    return folder


@pytest.fixture
def out(builds: Path, tmp_path: Path) -> Path:
    return shutil.copytree(builds / "f", tmp_path / "out")


def _results(out: Path) -> dict[str, str]:
    parts = ("stage/", "bundle/")
    return {name: digest for name, digest in digests_of(out).items() if name.startswith(parts)}


# --- the plan


def test_another_input_replaces_an_out_only_by_force_and_completely(
    builds: Path, out: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    before = digests_of(out)
    words = [str(builds / "g.ome.tif"), "-o", str(out), *FLAGS, "--grid", "1x1"]
    assert main(["build", *words]) == 1
    line = error_line(capfd)
    assert f"{out}: holds a build of 'f' (fingerprint " in line
    assert "not of 'g'" in line
    assert "choose another OUT, or --force replaces it" in line
    (out / "plan.json").unlink()  # other files still state the source
    assert main(["build", *words]) == 1
    assert "holds a build of another input (fingerprint" in error_line(capfd)
    shutil.copy(builds / "f" / "plan.json", out)
    assert digests_of(out) == before
    with pytest.raises(OutputError, match="force=True replaces it"):
        stereocell.build(builds / "g.ome.tif", out)
    assert main(["build", *words, "--force"]) == 0
    assert _results(out) == _results(builds / "g")
    assert [line for line in check(out) if not line.ok] == []


def test_other_settings_are_named_before_they_replace_results(
    builds: Path, out: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    plan = ["plan", str(builds / "f.ome.tif"), "-o", str(out), "--grid"]
    assert main([*plan, "2x1"]) == 0
    printed = capfd.readouterr().err
    assert "plan: OUT holds a build of this input with other settings" in printed
    assert "plan.grid: '1x1', now '2x1'" in printed
    assert main([*plan, "2x1"]) == 0
    assert "other settings" not in capfd.readouterr().err


@pytest.mark.parametrize("is_edit", [True, False])
def test_users_own_settings_in_out_are_not_replaced(
    builds: Path, out: Path, capfd: pytest.CaptureFixture[str], is_edit: bool
) -> None:
    file = out / "stereocell.toml"
    own = "[plan]\nlevel = 0\n"
    if is_edit:
        own = file.read_text("utf-8").replace("smoothing_um = ", "smoothing_um = 1")
    file.write_text(own)
    plan = ["plan", str(builds / "f.ome.tif"), "-o", str(out), "--grid", "1x1"]
    assert main(plan) == 1
    line = error_line(capfd)
    assert f"{file}: found a file that was edited by hand" in line
    assert "pass it by --config, or --force replaces it" in line
    assert file.read_text("utf-8") == own
    assert main([*plan, "--force"]) == 0
    assert file.read_bytes() == (builds / "f" / "stereocell.toml").read_bytes()


# --- stage, bundle, report, tissue


@pytest.mark.parametrize(
    ("phase", "name"),
    [("stage", "stage/thesis.tex"), ("bundle", "bundle/thesis.tex"), ("bundle", "thesis"),
     ("report", "report/index.html"), ("tissue", "tissue/thesis.tex")],
)  # fmt: skip
def test_part_that_somebody_else_wrote_stays_without_force(
    builds: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], phase: str, name: str
) -> None:
    out = shutil.copytree(builds / "f", tmp_path / "out")
    whole = name == "thesis"  # this folder is not a bundle
    for part in [phase] if phase != "bundle" or whole else []:
        shutil.rmtree(out / part, ignore_errors=True)
    if phase in ("stage", "report"):
        (out / "phases.json").unlink()
    elif phase == "bundle" and not whole:
        (out / "bundle" / "index.html").unlink()  # gives the command something to do
    own = out / ("bundle/thesis.tex" if whole else name)
    own.parent.mkdir(exist_ok=True)
    own.write_text(WORK)
    flags = [] if phase == "report" else FLAGS
    assert main([phase, str(out), *flags]) == 1
    line = error_line(capfd)
    assert own.name in line or "is no bundle" in line
    assert own.read_text("utf-8") == WORK
    if phase != "tissue":
        assert main([phase, str(out), *flags, "--force"]) == 0
        assert phase == "stage" or not own.exists() or own.read_text("utf-8") != WORK


def test_layer_edited_in_place_is_not_written_again_without_force(
    builds: Path, out: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    looks = out / "stage" / "looks" / "channels.usda"
    layer = Sdf.Layer.OpenAsAnonymous(str(looks))
    layer.GetAttributeAtPath("/Specimen/Channels/F.inputs:color").default = (1, 0, 0)
    layer.Export(str(looks))
    edited = looks.read_bytes()
    plan = ["plan", str(builds / "f.ome.tif"), "-o", str(out), "--grid", "1x1"]
    assert main([*plan, "--window", "F=100:900"]) == 0
    assert main(["units", str(out), *FLAGS]) == 0
    capfd.readouterr()
    assert main(["stage", str(out), *FLAGS]) == 1
    line = error_line(capfd)
    assert "looks/channels.usda: changed since it was written, by an edit" in line
    assert "or --force replaces it" in line
    assert looks.read_bytes() == edited
    assert main(["stage", str(out), *FLAGS, "--force"]) == 0
    assert looks.read_bytes() != edited


# --- pages, pictures and slices


def test_page_of_another_specimen_is_not_replaced_without_force(
    builds: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "site"
    assert main(["publish", str(builds / "f"), str(site)]) == 0
    there = digests_of(site)
    assert main(["publish", str(builds / "g"), str(site)]) == 1
    line = error_line(capfd)
    assert f"{site}: holds a published page of 'f' (" in line
    assert "expected one of 'g' (" in line
    assert digests_of(site) == there
    for source in (builds / "f", builds / "f" / "bundle", site):  # the same page again
        copy = tmp_path / "copy"
        assert main(["publish", str(source), str(copy)]) == 0
        assert digests_of(copy) == there
    assert main(["publish", str(builds / "g"), str(site), "--force"]) == 0
    assert [line for line in check(site) if not line.ok] == []


def test_folder_in_use_is_not_filled_with_a_page(
    builds: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "thesis.tex").write_text(WORK)
    monkeypatch.chdir(tmp_path)
    assert main(["publish", str(builds / "f"), "."]) == 1
    assert "holds something else (thesis.tex), expected nothing or a pub" in error_line(capfd)
    assert [file.name for file in tmp_path.iterdir()] == ["thesis.tex"]


def test_damaged_published_page_is_named_by_check(builds: Path, tmp_path: Path) -> None:
    site = tmp_path / "site"
    assert main(["publish", str(builds / "f"), str(site)]) == 0
    (site / "CNAME").write_text("me.example")
    assert [line for line in check(site) if not line.ok] == []
    packed = next(site.rglob("*.json.gz"))
    packed.write_bytes(packed.read_bytes()[:-1])
    (fault,) = [line.detail for line in check(site) if not line.ok]
    assert (
        f"{packed.relative_to(site)}: its size or hash differs from stereocell-published.json"
        in fault
    )


@pytest.mark.parametrize("name", ["cells.stl", "cells.gltf", "cells.nrrd"])
def test_export_replaces_its_own_file_until_somebody_edits_it(
    out: Path, builds: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    file = tmp_path / name
    for more in ([], ["--tiles", "r0_c0"], ["--channels", "F"]):
        assert main(["export", str(out), str(file), *more]) == 0
    assert [line for line in check(out) if not line.ok] == []
    capfd.readouterr()
    assert main(["export", str(builds / "g"), str(file)]) == 1  # the file shows another specimen
    assert "expected nothing or an earlier export of this build, as it was writ" in error_line(
        capfd
    )
    file.write_bytes(file.read_bytes() + b"\n")
    edited = file.read_bytes()
    assert main(["export", str(out), str(file)]) == 1
    assert "or --force replaces it" in error_line(capfd)
    assert file.read_bytes() == edited
    assert main(["export", str(out), str(file), "--force"]) == 0
    assert main(["export", str(out), str(file)]) == 0


@pytest.mark.parametrize("command", ["slices", "iso"])
def test_pictures_are_replaced_only_by_those_of_the_same_source(
    builds: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], command: str
) -> None:
    place = tmp_path / ("iso.png" if command == "iso" else "slices")
    more = ["--channel", "F", "--tile", "r0_c0"] if command == "iso" else []
    for name, code in (("f", 0), ("f", 0), ("g", 1)):
        capfd.readouterr()
        words = [command, str(builds / f"{name}.ome.tif"), "-o", str(place), *more]
        assert main(words) == code
    assert "of the same source: choose another place, or --force replaces it" in error_line(capfd)
    if command == "slices":
        (place / "notes.txt").write_text(WORK)
        assert main([command, str(builds / "f.ome.tif"), "-o", str(place)]) == 1
        assert "holds something else (notes.txt), expected slices and no other" in error_line(capfd)


# --- a rebuild that is stopped between two phases


def _rebuild(builds: Path, out: Path) -> list[str]:
    return ["build", str(builds / "f.ome.tif"), "-o", str(out), *FLAGS, "--grid", "2x1"]


@pytest.mark.parametrize("name", ["bundle/mine.txt", "stage/looks/channels.usda"])
def test_rebuild_is_refused_before_its_first_phase_writes(
    builds: Path, out: Path, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    own = out / name
    there = own.read_text("utf-8") if own.exists() else ""
    own.write_text(f"{there}\n# mine\n", "utf-8")
    before = digests_of(out)
    assert main(_rebuild(builds, out)) == 1
    assert "--force replaces it" in error_line(capfd)
    with pytest.raises(OutputError, match="force=True replaces it"):
        stereocell.build(builds / "f.ome.tif", out, settings={"plan": {"grid": "2x1"}})
    assert digests_of(out) == before


def test_mixed_results_of_two_plans_fail_check_and_publish(
    builds: Path, out: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "site"
    for command, stale in (
        (["plan", str(builds / "f.ome.tif"), "-o", str(out), "--grid", "2x1"], "units"),
        (["units", str(out), *FLAGS], "stage"),
        (["stage", str(out), *FLAGS], "bundle"),
        (["bundle", str(out), *FLAGS], "report"),
    ):
        assert main(command) == 0
        faults = [line.detail for line in check(out) if line.name == "records" and not line.ok]
        assert len(faults) == 1
        assert f"{out / stale}: made from another " in faults[0]
        assert f"run `stereocell {stale} OUT" in faults[0]
        capfd.readouterr()
        for source in (out, out / "bundle"):
            assert main(["publish", str(source), str(site)]) == 1
            line = error_line(capfd)
            assert f"{stale}: made from another " in line
            # The remedy names the build round the bundle, too.
            assert f"run `stereocell {stale} {out}" in line
            assert line.endswith(f"stereocell report {out}`")
    assert not site.exists()
    assert main(["report", str(out)]) == 0
    assert [line for line in check(out) if not line.ok] == []
    assert main(["publish", str(out), str(site)]) == 0


def test_results_of_the_same_input_at_another_place_are_current_again(
    builds: Path, out: Path, tmp_path: Path
) -> None:
    moved = shutil.copy(builds / "f.ome.tif", tmp_path / "f.ome.tif")
    before = _results(out)
    assert main(["build", str(moved), "-o", str(out), *FLAGS, "--grid", "1x1"]) == 0
    assert [line for line in check(out) if not line.ok] == []
    assert _results(out) == before


def test_no_file_is_written_where_no_scheduler_answers(
    builds: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    words = ["build", str(builds / "f.ome.tif"), "-o", str(out)]
    assert main([*words, "--scheduler", "tcp://127.0.0.1:1"]) == 1
    assert "--scheduler tcp://127.0.0.1:1" in error_line(capfd)
    assert not digests_of(out)

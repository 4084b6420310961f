"""Commands notice damage to any file of a build, and the printed remedies repair it."""

import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from stereocell.building.out_folder import OutFolder
from stereocell.building.sealed_documents import NEEDS
from stereocell.cli.__main__ import main
from stereocell.cli.places import PLACES
from stereocell.storage.kinds import Kind
from stereocell.verify import formats
from support.digests import digests_of
from support.exhaustive import sweep
from support.outputs import make_build, make_source

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("without_node")]

SOURCE = "f.ome.tif"
# Documents of each part on which a command may depend
DOCUMENTS = {
    "plan": ("plan.json", "provenance.json", "stereocell.toml"),
    "phases": ("phases.json",),
    "units": ("units/done.json", "units/plan.key", "units/survey.json"),
    "stage": ("stage/files.json",),
}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("built")
    out = make_build(make_source(folder / SOURCE), folder / "out")
    assert main(["export", str(out), str(folder / "f.glb")]) == 0
    return out


@pytest.fixture
def out(built: Path, tmp_path: Path) -> Path:
    return shutil.copytree(built, tmp_path / "out")


def _change(file: Path) -> None:
    """Change a letter or digit near the middle, so that JSON and TOML stay valid."""
    data = bytearray(file.read_bytes())
    after = range(len(data) // 2, len(data))
    place = next(k for k in after if data[k : k + 1].isalnum())
    data[place] = ord("1") if data[place] != ord("1") else ord("2")
    file.write_bytes(data)


DAMAGES: dict[str, Callable[[Path], object]] = {
    "changed": _change,
    "lost": Path.unlink,
    "empty": lambda file: file.write_bytes(b""),
}


# --- commands check the documents on which they depend


def test_commands_that_read_a_build_and_write_name_their_documents() -> None:
    reading = {name for name, one in PLACES.items() if Kind.BUILD in one.reads and one.writes}
    assert set(NEEDS) == reading
    assert {part for parts in NEEDS.values() for part in parts} == DOCUMENTS.keys()


def _trials() -> Iterator[tuple[str, str]]:
    for command, parts in NEEDS.items():
        for part in parts:
            yield from ((command, name) for name in DOCUMENTS[part])


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize(("command", "name"), list(_trials()))
def test_command_refuses_a_build_whose_documents_are_damaged(
    out: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], *,
    command: str, name: str, damage: str,
) -> None:  # fmt: skip
    DAMAGES[damage](out / name)
    before = digests_of(out)
    place = {"export": "f.glb", "publish": "site"}.get(command)
    words = [command, str(out), *([str(tmp_path / place)] if place else [])]
    assert main(words) == 1
    (line,) = [one for one in capfd.readouterr().err.splitlines() if "stereocell: " in one]
    assert name.rpartition("/")[2] in line
    assert "run `stereocell " in line
    assert digests_of(out) == before
    assert not place or not (tmp_path / place).exists()


@pytest.mark.parametrize(
    "name", ["specimen.usdz", "looks/F_default.exr", "looks/F_level.json", "tiles/r0_c0/F.vdb"]
)
@pytest.mark.parametrize("damage", ["changed", "lost"])
def test_bundle_names_a_missing_or_damaged_file_of_the_stage(
    out: Path, capfd: pytest.CaptureFixture[str], name: str, damage: str
) -> None:
    DAMAGES[damage](out / "stage" / name)
    assert main(["bundle", str(out), "--workers", "0"]) == 1
    printed = capfd.readouterr().err
    found = (
        "missing"
        if damage == "lost"
        else "damaged, because its size or hash differs from files.json"
    )
    assert f"{out / 'stage' / name}: {found}: " in printed
    assert f"run `stereocell stage {out}`" in printed


# --- remedies


def _follow(out: Path, lines: list[str], *, damaged: Path, source: Path) -> None:
    """Run the remedies that `check` prints, and nothing else."""
    if any(re.search(r"remove (it|the damaged files)", line) for line in lines):
        damaged.unlink(missing_ok=True)
    named = {name for line in lines for name in re.findall(r"stereocell (\w+) (?:OUT|INPUT)", line)}
    for name in ("plan", "units", "stage", "bundle", "report"):
        if name in named:
            given = [str(source), "-o", str(out), "--grid", "1x1"]
            assert main([name, *(given if name == "plan" else [str(out)])]) == 0, name


def _faults(out: Path) -> list[str]:
    return [line.detail for line in formats.check(out) if not line.ok]


def _names(out: Path) -> list[str]:
    """Return all JSON files, and one file of each other ending in each part."""
    first: dict[object, str] = {}
    for file in sorted(out.rglob("*")):
        path = file.relative_to(out)
        name = re.sub("[0-9a-f]{16,}", "", path.name)
        kind = name if path.suffix in (".json", ".toml", ".key") else path.suffix
        if file.is_file():
            first.setdefault((path.parts[0], kind), path.as_posix())
    return list(first.values())


# Each kind of file has one of the damages, in turn; the sweep tries all of them.
@pytest.mark.parametrize("turn", sweep([0, 1, 2], kept=[0]))
def test_remedies_that_check_prints_repair_the_damage(
    built: Path, tmp_path: Path, turn: int
) -> None:
    unnoticed = []
    for i, name in enumerate(_names(built)):
        out = shutil.copytree(built, tmp_path / "out")
        kind = list(DAMAGES)[(i + turn) % len(DAMAGES)]
        DAMAGES[kind](out / name)
        faults = _faults(out)
        if not faults:
            unnoticed.append(name)
        _follow(out, faults, damaged=out / name, source=built.parent / SOURCE)
        assert _faults(out) == [], f"{name} {kind}: {faults}"
        shutil.rmtree(out)
    # No result depends on these files: seconds of a unit, and tiles that need no work.
    kept = {"seconds.json", "stage.json", "exports.json"}
    assert {Path(name).name for name in unnoticed} <= kept


@pytest.mark.parametrize("damage", sweep(DAMAGES, kept=["changed"]))
def test_damaged_record_of_the_phases_has_one_remedy(
    out: Path, built: Path, damage: str, capfd: pytest.CaptureFixture[str]
) -> None:
    DAMAGES[damage](OutFolder(out).phases_file)
    faults = _faults(out)
    assert {line.partition("run `")[2] for line in faults} == {
        "stereocell units OUT && stereocell stage OUT && stereocell bundle OUT && "
        "stereocell report OUT` again"
    }
    capfd.readouterr()
    assert main(["export", str(out), str(out.parent / "f.glb")]) == 1
    assert f"run `stereocell units {out} && stereocell stage {out} && " in capfd.readouterr().err
    _follow(out, faults, damaged=OutFolder(out).phases_file, source=built.parent / SOURCE)
    assert _faults(out) == []


@pytest.mark.parametrize("lost", [["manifest.json"], ["manifest.json", "files.json"]])
def test_bundle_without_its_manifest_is_made_again_and_foreign_files_stay(
    out: Path, built: Path, capfd: pytest.CaptureFixture[str], lost: list[str]
) -> None:
    for name in lost:
        (out / "bundle" / name).unlink()
    own = out / "bundle" / "thesis.tex"
    own.write_text("years of work")
    assert main(["bundle", str(out)]) == 1
    assert "found something else (thesis.tex), but no manifest.json, " in capfd.readouterr().err
    assert own.read_text("utf-8") == "years of work"
    own.unlink()
    assert main(["bundle", str(out)]) == 0
    bundles = [digests_of(place / "bundle") for place in (out, built)]
    assert bundles[0] == bundles[1]

"""The record of steps follows all the code, files and libraries that make a result."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import packages_distributions, requires
from pathlib import Path
from typing import Any, ClassVar

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from stereocell.engine import step_record as shipped
from stereocell.engine.step_record import libraries_of
from stereocell.planning.provenance import STEPS
from stereocell.read.known_formats import known_formats
from stereocell.storage.assets import find_asset
from support import step_record

PACKAGE = step_record.PACKAGE
UNITS = {"BuildUnit"}
TOP = PACKAGE.parents[1]
TILES = {"FindWindow", "GatherEvidence", "SumComponents", "BuildUnit"}
OBJECTS = {"FindExtents", "BuildObjects"}


@pytest.fixture(scope="module")
def recorded() -> dict[str, Any]:
    return step_record.record()


@pytest.fixture(scope="module")
def reaches() -> dict[str, set[Path]]:
    """The files whose code each step and each reader reaches."""
    modules = {step.__name__: step.__module__ for step in step_record.find_steps()}
    modules |= {name: reader.module for name, reader in known_formats().items()}
    return {name: set(step_record.reach(module)[0]) for name, module in modules.items()}


@pytest.mark.parametrize(
    ("file", "reached", "others"),
    [
        ("cli/__main__.py", set(), TILES | {"WriteStage", "WriteBundle", "WriteReport"}),
        ("storage/lock.py", set(), TILES | {"WriteStage", "WriteBundle", "WriteReport"}),
        ("engine/run.py", set(), TILES | {"WriteStage", "WriteBundle", "WriteReport"}),
        ("textures/tangents.py", UNITS | {"WriteBundle"}, {"FindWindow", "WriteStage"}),
        ("meshes/simplify.py", UNITS | {"WriteBundle"}, {"FindWindow", "nifti"}),
        ("filters/denoise.py", TILES - {"FindWindow"}, {"nifti"}),
        ("filters/reach.py", TILES, {"nifti"}),
        ("isosurface/level_evidence.py", {"FindWindow", "GatherEvidence"}, {"BuildUnit"}),
        ("read/formats/ome_zarr/image.py", {"ome-zarr"}, TILES),
        ("read/formats/tiff/ome.py", {"tiff"}, TILES | {"dicom"}),
        ("read/formats/dicom/frame.py", {"dicom"}, TILES | {"tiff"}),
        ("formats/exr.py", {"WriteStageTile", "WriteStage", "WriteBundle"}, TILES),
        ("formats/gltf.py", {"WriteBundle"}, TILES),
        ("objects/extents.py", OBJECTS, TILES),
        ("storage/open_hdf5.py", {"hdf5", "ims", "bdv"}, TILES | {"tiff"}),
    ],
)
def test_a_step_reaches_the_modules_that_can_change_its_result(
    reaches: dict[str, set[Path]], file: str, reached: set[str], others: set[str]
) -> None:
    found = {name for name, files in reaches.items() if PACKAGE / file in files}
    assert reached <= found
    assert not others & found


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace(" = 765", " = 766"),
        lambda text: text.replace("edges: ", "other: "),
    ],
)
def test_a_changed_constant_in_a_reached_file_asks_for_a_decision(
    recorded: dict[str, Any], monkeypatch: pytest.MonkeyPatch, change: Callable[[str], str]
) -> None:
    path, read = PACKAGE / "objects" / "extents.py", Path.read_bytes
    text = f"{path.read_text('utf-8')}\n_NUMBER = 765\nedges: int\n"

    def entry(content: str) -> str:
        monkeypatch.setattr(
            Path,
            "read_bytes",
            lambda self: content.encode() if self == path else read(self),
        )
        found = step_record._entry("stereocell.steps.find_extents", 1)
        monkeypatch.undo()
        return str(found["code"])

    before = entry(text)
    assert entry(f"# a comment\n{text}") == before
    assert entry(change(text)) != before != recorded["steps"]["FindExtents"]["code"]


@pytest.mark.slow
def test_make_lint_asks_for_a_version_where_a_constant_changed(tmp_path: Path) -> None:
    """The command runs in a copy of the tree, where a comment changed in a second file."""
    module = "support.step_record"
    assert f"-m {module.partition('.')[0]}" in (TOP / "Makefile").read_text("utf-8")
    assert "\n\t$(SUPPORT).step_record\n" in (TOP / "Makefile").read_text("utf-8")
    without = shutil.ignore_patterns("__pycache__", "*.tif")
    for name in ("pipeline", "schemas", "usd_assets", "tests/support"):
        shutil.copytree(TOP / name, tmp_path / name, ignore=without)
    for lock in step_record.LOCKS:
        shutil.copy2(lock, tmp_path)
    package = tmp_path / "pipeline" / PACKAGE.name
    reach = package / "filters" / "reach.py"
    constant = "SMOOTHING_REACH = 4.0"
    text = reach.read_text("utf-8")
    assert text.count(constant) == 1
    reach.write_text(text.replace(constant, "SMOOTHING_REACH = 4.5"), encoding="utf-8")
    with (package / "objects" / "extents.py").open("a", encoding="utf-8") as file:
        file.write("# This comment is new.\n")
    done = subprocess.run(
        [sys.executable, "-m", module],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(["tests", "pipeline"])},
        capture_output=True,
        text=True,
        check=False,
    )
    changed, question = done.stderr.splitlines()
    assert done.returncode == 1
    named = set(changed.removeprefix("the code of ").removesuffix(" changed").split(", "))
    assert named >= TILES
    assert not named & {"FindExtents", *known_formats()}
    assert "raise the step's VERSION" in question


@pytest.mark.parametrize("file", ["usd_assets/lights.usda", "schemas/usd/schema.usda"])
def test_a_shipped_file_counts_for_the_steps_that_find_it(
    reaches: dict[str, set[Path]], file: str
) -> None:
    found = {name for name, files in reaches.items() if find_asset(file) in files}
    assert "WriteStage" in found
    assert not TILES & found


def test_the_lines_of_the_command_name_each_decision(recorded: dict[str, Any]) -> None:
    steps = {name: dict(entry) for name, entry in recorded["steps"].items()}
    now = {"steps": steps, "libraries": {**recorded["libraries"], "numpy": "99"}}
    steps["BuildUnit"]["code"] = "other"
    steps["FindWindow"]["version"] += 1
    del steps["nifti"]
    code, version, gone, library = step_record.compare(now, recorded)
    assert code == "the code of BuildUnit changed"
    assert version == "the VERSION of FindWindow was raised"
    assert gone == "nifti: new, or gone"
    assert library.startswith("numpy is locked at 99, recorded ")
    assert "BuildUnit" in library
    steps["FindWindow"]["version"] -= 2
    with pytest.raises(SystemExit, match="FindWindow: VERSION is"):
        step_record.compare(now, recorded)
    assert step_record.compare(recorded, recorded) == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("x = 1", "x = 1  # one"),
        ("def f():\n    return 1", 'def f():\n    """Say one."""\n    return 1'),
        ('"""A module."""\nx = 1', '"""Another."""\n\n\nx = 1'),
        ("if a:\n    b()", "if a:\n\n    # so\n    b()"),
    ],
)
def test_comments_docstrings_and_empty_lines_change_no_digest(old: str, new: str) -> None:
    assert step_record.digest_of(old) == step_record.digest_of(new)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("x = 1", "x = 2"),
        ('x = "a"', 'x = "b"'),
        ('raise ValueError("words")', 'raise KeyError("words")'),
        ('x = "# no comment"', 'x = "# other"'),
    ],
)
def test_other_code_changes_the_digest(old: str, new: str) -> None:
    assert step_record.digest_of(old) != step_record.digest_of(new)


def test_modules_that_are_left_out_exist() -> None:
    for part in step_record.NEUTRAL:
        assert f"stereocell.{part}" in step_record._modules(), part


@pytest.mark.parametrize(
    ("library", "readers"),
    [
        ("pylibCZIrw", {"czi"}),
        ("liffile", {"lif"}),
        ("nd2", {"nd2"}),
        ("hdf5plugin", {"hdf5", "ims", "bdv"}),
        ("imagecodecs", {"tiff", "planes", "dicom"}),
        ("python-gdcm", {"dicom"}),
        ("pylibjpeg-openjpeg", {"dicom"}),
        ("bioio_*", {"other"}),
    ],
)
def test_a_decoder_counts_as_a_library_of_its_reader_only(library: str, readers: set[str]) -> None:
    modules = {name: reader.module for name, reader in known_formats().items()}
    users = {name for name, module in modules.items() if library in step_record.reach(module)[1]}
    assert users == readers
    assert library not in step_record.reach("stereocell.steps.build_unit")[1]


def test_libraries_that_can_change_no_byte_ask_for_no_decision(recorded: dict[str, Any]) -> None:
    assert {"numpy", "vtk", "edt", "zarr", "pylibCZIrw"} <= recorded["libraries"].keys()
    others = {
        "alktx2",
        "pymeshlab",
        "xatlas",
    }  # packages of extras are fields of the steps that use them
    others |= {"aiohttp", "botocore", "psutil", "jsonschema", "distributed"}
    assert not others & recorded["libraries"].keys()


def test_provenance_names_only_installed_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    found = libraries_of("BuildUnit", "FindWindow", "ome-zarr")
    assert {"numpy", "vtk", "connected-components-3d", "zarr"} <= found.keys()
    assert {"usd-core", "OpenEXR"} <= libraries_of("WriteStageTile").keys()
    assert "bioio" not in libraries_of("other")

    class Plugin:
        metadata: ClassVar = {"Name": "bioio-czi"}

    monkeypatch.setattr(shipped, "distributions", lambda: [Plugin()])
    monkeypatch.setattr(shipped, "version", lambda name: "1.2")
    shipped._versions.cache_clear()
    try:
        assert libraries_of("other")["bioio-czi"] == "1.2"
    finally:
        shipped._versions.cache_clear()


@pytest.mark.slow
def test_packages_are_found_as_python_finds_them() -> None:
    found = step_record._distributions()
    for top, names in packages_distributions().items():
        assert set(found[top]) == set(names), top


BESIDE = {
    "bioio",
    "bioio_base",
}  # packages that a user installs beside StereoCell (read/formats/other.py)


@pytest.mark.slow
def test_all_imported_packages_are_declared_as_dependencies() -> None:
    """A package that another one brings along disappears when that one stops to need it."""
    declared = {canonicalize_name(Requirement(line).name) for line in requires("stereocell") or ()}
    installed = step_record._distributions()
    for file in PACKAGE.rglob("*.py"):
        for name in step_record._needs(file)[1]:
            top = name.split(".")[0]
            if top not in {*sys.stdlib_module_names, "stereocell", *BESIDE}:
                owners = {canonicalize_name(package) for package in installed[top]}
                assert owners & declared, f"{file.name} imports {top}"


def test_steps_that_a_provenance_names_exist(recorded: dict[str, Any]) -> None:
    assert set(STEPS) <= {step.__name__ for step in step_record.find_steps()}
    assert set(STEPS) <= recorded["steps"].keys()

"""A result's key follows all the code, files and libraries that make it, and nothing else."""

import shutil
import sys
from importlib.metadata import packages_distributions, requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from stereocell import report
from stereocell.building import stage_tasks, tasks
from stereocell.bundle import write as bundle_writer
from stereocell.storage import assets, cache_key

ROOT = Path(__file__).parents[2]
MAKERS = {"units": tasks, "stage": stage_tasks, "bundle": bundle_writer, "report": report}


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkout of the package and of what ships beside it."""
    folder = tmp_path_factory.mktemp("checkout")
    ignore = shutil.ignore_patterns("__pycache__")
    for name in ("pipeline", "schemas", "usd_assets"):
        shutil.copytree(ROOT / name, folder / name, ignore=ignore)
    return folder


@pytest.fixture(scope="module")
def before(copy: Path) -> dict[str, str]:
    return keys(copy)


def keys(checkout: Path) -> dict[str, str]:
    """Each maker's key, as if the package lay in that checkout: only its files are read."""
    package = checkout / "pipeline" / "stereocell"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cache_key, "_PACKAGE", package)
        patch.setattr(assets, "_HOMES", (package, checkout))
        try:
            _forget()
            return {name: cache_key.key_of("x", maker) for name, maker in MAKERS.items()}
        finally:
            _forget()


def _forget() -> None:
    cache_key._digest.cache_clear()
    cache_key._lineage.cache_clear()
    cache_key._needs.cache_clear()
    cache_key._modules.cache_clear()


@pytest.mark.parametrize(
    ("file", "reached"),
    [
        ("pipeline/stereocell/cli/__main__.py", set()),
        ("pipeline/stereocell/meshes/simplify.py", {"units", "stage", "report"}),
        ("pipeline/stereocell/read/ome_zarr.py", {"units", "report"}),
        ("pipeline/stereocell/formats/exr.py", {"stage", "bundle"}),
        ("pipeline/stereocell/formats/gltf.py", {"bundle"}),
        ("pipeline/stereocell/building/stage_tasks.py", {"stage"}),
        ("usd_assets/lights.usda", {"stage"}),
        ("schemas/usd/schema.usda", {"stage", "bundle"}),
        ("pipeline/stereocell/report/charts.py", {"report"}),
    ],
)
def test_key_changes_with_what_makes_the_result(copy: Path, file: str, reached: set[str]) -> None:
    before = keys(copy)
    content = (copy / file).read_bytes()
    (copy / file).write_bytes(content + b"\n# changed\n")
    after = keys(copy)
    (copy / file).write_bytes(content)
    assert {maker for maker in MAKERS if before[maker] != after[maker]} == reached


def test_versions_of_libraries_count_those_of_lone_extension_modules_too() -> None:
    assert {"numpy", "vtk", "xatlas", "edt", "zarr"} <= cache_key.libraries_of(tasks).keys()
    assert {"usd-core", "OpenEXR"} <= cache_key.libraries_of(stage_tasks).keys()


def test_packages_are_found_as_python_finds_them() -> None:
    found = cache_key._distributions()
    for top, names in packages_distributions().items():
        assert {package.name for package in found[top]} == set(names), top


def test_what_is_imported_is_declared() -> None:
    """A package that comes along with another one is gone when that one does without it."""
    declared = {canonicalize_name(Requirement(line).name) for line in requires("stereocell") or ()}
    installed = cache_key._distributions()
    for file in (ROOT / "pipeline" / "stereocell").rglob("*.py"):
        for name in cache_key._needs(file)[1]:
            top = name.split(".")[0]
            if top not in sys.stdlib_module_names and top != "stereocell":
                owners = {canonicalize_name(package.name) for package in installed[top]}
                assert owners & declared, f"{file.name} imports {top}"

"""A result's key follows all the code, files and libraries that make it, and nothing else."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ASK = """
from stereocell import lineage, report, staging, tasks
from stereocell.write import bundle
print(*(lineage.key_of("x", maker) for maker in (tasks, staging, bundle, report)))
"""
MAKERS = ("units", "stage", "bundle", "report")


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
    return _keys(copy)


def _keys(checkout: Path) -> dict[str, str]:
    code = f"import sys; sys.path.insert(0, {str(checkout / 'pipeline')!r})\n{ASK}"
    answer = subprocess.check_output([sys.executable, "-c", code], text=True)
    return dict(zip(MAKERS, answer.split(), strict=True))


@pytest.mark.parametrize(
    ("file", "reached"),
    [
        ("pipeline/stereocell/cli.py", set()),
        ("pipeline/stereocell/lod.py", {"units", "stage", "report"}),
        ("pipeline/stereocell/read/ome_zarr.py", {"units", "report"}),
        ("pipeline/stereocell/write/exr.py", {"stage", "bundle"}),
        ("pipeline/stereocell/write/gltf.py", {"bundle"}),
        ("pipeline/stereocell/staging.py", {"stage"}),
        ("usd_assets/lights.usda", {"stage"}),
        ("schemas/usd/schema.usda", {"stage", "bundle"}),
        ("pipeline/stereocell/report/charts.py", {"report"}),
    ],
)
def test_key_changes_with_what_makes_the_result(
    copy: Path, before: dict[str, str], file: str, reached: set[str]
) -> None:
    content = (copy / file).read_bytes()
    (copy / file).write_bytes(content + b"\n# changed\n")
    after = _keys(copy)
    (copy / file).write_bytes(content)
    assert {maker for maker in MAKERS if before[maker] != after[maker]} == reached


def test_versions_of_libraries_count_those_of_lone_extension_modules_too() -> None:
    from stereocell import lineage, staging, tasks

    assert {"numpy", "vtk", "xatlas", "edt", "zarr"} <= lineage.libraries_of(tasks).keys()
    assert {"usd-core", "OpenEXR"} <= lineage.libraries_of(staging).keys()

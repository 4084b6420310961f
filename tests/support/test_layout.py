"""Layout of the tests: tests/ and the viewer's test/ mirror the code; no test imports another."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import Mock

import pytest

from support.long_files import LONG_FILES

TESTS = Path(__file__).parents[1]
ROOT = TESTS.parent
PACKAGE = ROOT / "pipeline" / "stereocell"
VIEWER = ROOT / "viewer_gltf"
# Folders that mirror no package: tests of the whole, of other languages and programs, shared code
OF_THE_WHOLE = {
    "bench", "blender", "corpus", "docs", "malformed", "support", "system", "unity",
}  # fmt: skip
OF_THE_PAGE = {"interop", "page", "shaders", "support"}


def folders(of: Path) -> set[str]:
    """Return the paths of the folders that hold source files, without generated ones."""
    generated = {"__pycache__", "node_modules"}
    files = (file.relative_to(of) for file in of.rglob("*") if file.suffix in (".py", ".ts"))
    return {
        place.parent.as_posix()
        for place in files
        if len(place.parts) > 1 and not generated.intersection(place.parts)
    }


def imported(module: str) -> Iterator[str]:
    """Yield the names that a Python module imports; a name from a package includes the package."""
    for node in ast.walk(ast.parse(module)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module or ''}.{alias.name}" for alias in node.names)


def touches_files(module: str) -> Iterator[str]:
    """Yield names in a Python module by which the standard library reads or writes files."""
    methods = {"open", "read_bytes", "read_text", "write_bytes", "write_text", "mkdir", "unlink"}
    for node in ast.walk(ast.parse(module)):
        if isinstance(node, ast.Call):
            called = node.func
            name = called.id if isinstance(called, ast.Name) else getattr(called, "attr", "")
            if name in methods or name in ("fromfile", "tofile", "memmap", "savez"):
                yield name
    yield from {"os", "io", "shutil", "tempfile", "subprocess"} & {
        name.partition(".")[0] for name in imported(module)
    }


def names_a_test(module: str) -> bool:
    """Return whether a dotted name is a test module, or a folder of tests except the shared one."""
    first, *_ = parts = module.strip(".").split(".")
    return any(re.fullmatch(r"test_\w+", part) for part in parts) or first == "tests"


# Algorithms: the packages to the left of the bar in docs/architecture.md
WITHOUT_FILES = (
    "model", "filters", "transfer", "isosurface", "objects", "meshes", "textures", "tissue",
    "kernels",
)  # fmt: skip
OF_COMPILING = {"cache_place.py", "compile_all.py"}  # modules that place and fill numba's cache


@pytest.mark.parametrize("package", WITHOUT_FILES)
def test_an_algorithm_touches_no_file(package: str) -> None:
    modules = list((PACKAGE / package).rglob("*.py"))
    assert modules
    found = {
        file.relative_to(PACKAGE).as_posix(): list(touches_files(file.read_text("utf-8")))
        for file in modules
        if file.name not in OF_COMPILING
    }
    assert {name: calls for name, calls in found.items() if calls} == {}


@pytest.mark.parametrize(
    "module",
    ["open('a')", "path.read_bytes()", "np.fromfile(x)", "from os import path", "import io"],
)
def test_names_that_touch_files_are_found(module: str) -> None:
    assert list(touches_files(module))


@pytest.mark.parametrize(
    ("module", "expected"),
    [
        ("from test_seams import scene", True),
        ("from building.test_seams import scene", True),
        ("from tests.building import scene", True),
        ("def late():\n    import building.test_seams as seams", True),
        ("from . import test_seams", True),
        ("from support import phantoms", False),
        ("import latest_thing", False),
    ],
)
def test_import_of_a_test_is_found(module: str, expected: bool) -> None:
    assert any(names_a_test(name) for name in imported(module)) == expected


@pytest.mark.slow
def test_no_test_imports_another_and_nothing_shared_imports_a_test() -> None:
    modules = {
        file: file.read_text("utf-8") for file in TESTS.rglob("*.py") if ".venv" not in file.parts
    }
    assert len(modules) > 100
    found = [
        f"{file.relative_to(ROOT)} imports {name}"
        for file, module in modules.items()
        for name in imported(module)
        if names_a_test(name)
    ]
    assert found == []


def test_no_browser_test_imports_another() -> None:
    modules = sorted((VIEWER / "test").rglob("*.ts"))
    assert modules
    address = re.compile(r"""\b(?:from|import)\s*\(?\s*["']([^"']+\.test(?:\.ts)?)["']""")
    found = [
        f"{file.relative_to(ROOT)} imports {name}"
        for file in modules
        for name in address.findall(file.read_text("utf-8"))
    ]
    assert found == []


def test_folders_of_tests_are_those_of_the_package() -> None:
    mirrored = {name for name in folders(TESTS) if name.split("/")[0] not in OF_THE_WHOLE}
    assert mirrored - folders(PACKAGE) == set()
    assert {name.split("/")[0] for name in folders(TESTS)} >= OF_THE_WHOLE


def test_folders_of_browser_tests_are_those_of_the_viewer() -> None:
    mirrored = {name for name in folders(VIEWER / "test") if name.split("/")[0] not in OF_THE_PAGE}
    assert mirrored - folders(VIEWER / "src") == set()
    assert {name.split("/")[0] for name in folders(VIEWER / "test")} >= OF_THE_PAGE


def test_long_files_exist() -> None:
    assert [file for file in LONG_FILES if not file.is_file()] == []


def test_long_files_run_first(request: pytest.FixtureRequest) -> None:
    files = [TESTS / "filters/test_background.py", TESTS / "isosurface/test_channel_level.py"]
    items = [Mock(path=file, **{"get_closest_marker.return_value": None}) for file in files]
    plugin = request.config.pluginmanager.get_plugin(str(TESTS / "conftest.py"))
    plugin.pytest_collection_modifyitems(request.config, items)
    assert [item.path for item in items] == files[::-1]

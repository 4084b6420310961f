"""A result's key follows all the code, files and libraries that make it, and nothing else."""

import ast
import re
import shutil
import sys
from collections.abc import Callable
from importlib.metadata import packages_distributions, requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from stereocell.building import stage_tasks
from stereocell.building.tasks import evidence, unit, window
from stereocell.bundle import write as bundle_writer
from stereocell.read.open_dataset import READERS
from stereocell.report import page
from stereocell.storage import assets, cache_key, source_code

ROOT = Path(__file__).parents[2]
ZARR, TIFF = READERS["ome-zarr"].module, READERS["tiff"].module
MAKERS = {
    "window": (window, ZARR),
    "evidence": (evidence, ZARR),
    "unit": (unit, ZARR),
    "unit of a TIFF": (unit, TIFF),
    "stage": (stage_tasks,),
    "bundle": (bundle_writer,),
    "report": (page,),
}
UNITS = {"unit", "unit of a TIFF"}
TASKS = UNITS | {"window", "evidence"}


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
            return {name: cache_key.key_of("x", *makers) for name, makers in MAKERS.items()}
        finally:
            _forget()


def _forget() -> None:
    """Forget what was found in files; what a module's bytes make is the same everywhere."""
    cache_key._digest.cache_clear()
    cache_key._reach.cache_clear()
    cache_key._needs.cache_clear()
    cache_key._modules.cache_clear()


def changed(
    before: dict[str, str], checkout: Path, file: str, change: Callable[[str], str]
) -> set[str]:
    """The makers whose key follows a change of one file; `before` are the keys without it."""
    path = checkout / file
    content = path.read_text()
    path.write_text(change(content))
    assert path.read_text() != content
    after = keys(checkout)
    path.write_text(content)
    return {maker for maker in MAKERS if before[maker] != after[maker]}


def change_a_number(text: str) -> str:
    """The same module with another value of its first number."""
    number = next(
        node
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Constant) and type(node.value) in (int, float)
    )
    lines = text.encode().splitlines(keepends=True)
    line = lines[number.lineno - 1]
    lines[number.lineno - 1] = line[: number.col_offset] + b"765" + line[number.end_col_offset :]
    return b"".join(lines).decode()


PACKAGE = "pipeline/stereocell"


@pytest.mark.parametrize(
    ("file", "reached"),
    [
        ("cli/__main__.py", set()),
        ("storage/lock.py", set()),
        ("engine/run.py", set()),
        ("serve/limits.py", set()),
        ("textures/tangents.py", UNITS | {"bundle", "report"}),
        ("meshes/simplify.py", UNITS | {"bundle"}),
        ("filters/denoise.py", TASKS | {"stage", "bundle", "report"}),
        ("isosurface/level_evidence.py", {"evidence", "window", "report"}),
        ("transfer/boundaries.py", {"window", "report"}),
        ("read/ome_zarr.py", TASKS - {"unit of a TIFF"}),
        ("read/tiff/ome.py", {"unit of a TIFF"}),
        ("read/dicom/frame.py", set()),
        ("read/nifti.py", set()),
        ("formats/exr.py", {"stage", "bundle"}),
        ("formats/gltf.py", {"bundle"}),
        ("building/stage_tasks.py", {"stage"}),
        ("report/charts.py", {"report"}),
    ],
)
def test_a_constant_changes_the_keys_of_what_it_makes(
    copy: Path, before: dict[str, str], file: str, reached: set[str]
) -> None:
    assert changed(before, copy, f"{PACKAGE}/{file}", change_a_number) == reached


@pytest.mark.parametrize(
    ("file", "reached"),
    [("usd_assets/lights.usda", {"stage"}), ("schemas/usd/schema.usda", {"stage", "bundle"})],
)
def test_an_asset_changes_the_keys_of_what_is_made_of_it(
    copy: Path, before: dict[str, str], file: str, reached: set[str]
) -> None:
    assert changed(before, copy, file, lambda text: f"{text}\n# changed\n") == reached


@pytest.mark.slow
def test_comments_and_docstrings_change_no_key(copy: Path, before: dict[str, str]) -> None:
    """In all modules at once: a comment above, one in each body, another docstring."""
    for file in (copy / PACKAGE).rglob("*.py"):
        text = file.read_text()
        if text.startswith('"""'):
            text = '"""Another' + text[3:]
        text = re.sub(r'^( +)"""(?=\w)', r'\1# a comment\n\1"""Another ', text, flags=re.MULTILINE)
        file.write_text(f"# changed\n{text}\n# changed\n")
    after = keys(copy)
    shutil.rmtree(copy / PACKAGE)
    shutil.copytree(ROOT / PACKAGE, copy / PACKAGE)
    assert after == before


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("", ""),
        ("def f(): return 1", 'def f():\n    """Say one."""\n    return 1'),
        ("class A:\n    pass", 'class A:\n    """Nothing."""'),
        ('raise ValueError(f"{a}: found {b}")', 'raise ValueError(f"{a}: not {b:.2f}, " "other")'),
        ('raise Error("words") from None', 'raise Error("other words") from None'),
        ('console.print("done")', 'console.print(f"{a} is done")'),
        ('log.info("done")', 'log.info("ready")'),
        ('warnings.warn("old", stacklevel=2)', 'warnings.warn("older", stacklevel=2)'),
        ('x = setting(1, "what it does")', 'x = setting(1, "what it is for")'),
    ],
)
def test_words_for_people_change_no_code(old: str, new: str) -> None:
    assert code(old) == code(new)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("x = 1", "x = 2"),
        ('x = "a"', 'x = "b"'),
        ("x = setting(1, '')", "x = setting(2, '')"),
        ('raise ValueError("words")', 'raise KeyError("words")'),
        ('raise Error("words", code=1)', 'raise Error("words", code=2)'),
        ('if a:\n    raise Error("words")', 'if b:\n    raise Error("words")'),
        ('console.print("done")', "run()"),
        ('words = "done"', 'words = "ready"'),
        ("def f(a): return a", "def f(a): return b"),
    ],
)
def test_code_changes_the_code(old: str, new: str) -> None:
    assert code(old) != code(new)


def code(text: str) -> str:
    return source_code.read_source(text.encode()).code


def test_only_libraries_that_can_change_a_byte_are_in_a_unit_s_key() -> None:
    _, libraries = cache_key._reach(unit.__name__, cache_key.NEUTRAL)
    _, of_reader = cache_key._reach(ZARR, cache_key.NEUTRAL)
    named = {name for name, _ in libraries} | {name for name, _ in of_reader}
    assert {"numpy", "vtk", "xatlas", "edt", "zarr"} <= named
    others = {"aiohttp", "botocore", "psutil", "jsonschema", "distributed", "rich", "pydicom"}
    assert not others & named


def test_modules_that_are_left_out_exist() -> None:
    for part in cache_key.NEUTRAL:
        assert f"stereocell.{part}" in cache_key._modules(), part


def test_versions_of_libraries_count_those_of_lone_extension_modules_too() -> None:
    assert {"numpy", "vtk", "xatlas", "edt", "zarr"} <= cache_key.libraries_of(unit, ZARR).keys()
    assert {"usd-core", "OpenEXR"} <= cache_key.libraries_of(stage_tasks).keys()


@pytest.mark.slow
def test_packages_are_found_as_python_finds_them() -> None:
    found = cache_key._distributions()
    for top, names in packages_distributions().items():
        assert {package.name for package in found[top]} == set(names), top


@pytest.mark.slow
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

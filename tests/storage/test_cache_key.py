"""A result's key follows all the code, files and libraries that make it, and nothing else."""

import ast
import re
import shutil
import sys
from collections.abc import Callable
from importlib.metadata import packages_distributions, requires
from pathlib import Path
from typing import ClassVar

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from stereocell.building.steps import build_unit as unit
from stereocell.building.steps import find_window as window
from stereocell.building.steps import gather_evidence as evidence
from stereocell.building.steps import write_stage_tile as stage_tasks
from stereocell.bundle import write as bundle_writer
from stereocell.read.readers import OTHER, READERS
from stereocell.report import page
from stereocell.storage import assets, cache_key, message_texts, source_code

ROOT = Path(__file__).parents[2]
ZARR, TIFF, DICOM = (READERS[name].module for name in ("ome-zarr", "tiff", "dicom"))
MAKERS = {
    "window": (window, ZARR),
    "evidence": (evidence, ZARR),
    "unit": (unit, ZARR),
    "unit of a TIFF": (unit, TIFF),
    "unit of DICOM": (unit, DICOM),
    "stage": (stage_tasks,),
    "bundle": (bundle_writer,),
    "report": (page,),
}
UNITS = {"unit", "unit of a TIFF", "unit of DICOM"}
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
    content = path.read_text("utf-8")
    path.write_text(change(content))
    assert path.read_text("utf-8") != content
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
        ("read/ome_zarr.py", {"window", "evidence", "unit"}),
        ("read/tiff/ome.py", {"unit of a TIFF"}),
        ("read/dicom/frame.py", {"unit of DICOM"}),
        ("read/nifti.py", set()),
        ("formats/exr.py", {"stage", "bundle"}),
        ("formats/gltf.py", {"bundle"}),
        ("building/steps/write_stage_tile.py", {"stage"}),
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


ROW = '    "mrc": Reader('


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("read/readers.py", ROW, '    "new": Reader("stereocell.read.new", "New"),\n' + ROW),
        ("read/readers.py", '"OME-Zarr"', '"Zarr"'),
        ("read/file_kind.py", '"nifti": _Kind(("nifti",),', '"nifti": _Kind(("nifti", "new"),'),
        ("read/remarks.py", "building the first alone", "the first is built"),
    ],
)
def test_what_chooses_a_reader_or_tells_of_it_changes_no_key(
    copy: Path, before: dict[str, str], file: str, old: str, new: str
) -> None:
    found = changed(before, copy, f"{PACKAGE}/{file}", lambda text: text.replace(old, new, 1))
    assert found == set()


def test_the_reader_is_in_the_key() -> None:
    """By its name, since two may import each other."""
    of_readers = [cache_key.key_of("", reader.module) for reader in (*READERS.values(), OTHER)]
    assert len(set(of_readers)) == len(READERS) + 1


@pytest.mark.parametrize(
    ("file", "old", "new", "reached"),
    [
        ("read/dataset.py", '"chunks that are whole"', '"whole chunks"', set()),
        ("read/dataset.py", '"its index 0"', '"the index 0"', set()),
        ("building/unit_files.py", '"damaged, not the bytes', '"damaged, other bytes', set()),
        (
            "building/unit_files.py",
            '"lod{level}.npz"',
            '"level{level}.npz"',
            UNITS | {"stage", "report"},
        ),
        ("read/spacing.py", '"centimeter"', '"centimetre"', TASKS | {"report"}),
        # a result says why it has no surface, or no maps
        ("building/unit.py", '"no voxel crosses the iso-value"', '"nothing crosses it"', UNITS),
        (
            "textures/unwrap.py",
            " charts, too many",
            " charts: too many",
            UNITS | {"bundle", "report"},
        ),
    ],
)
def test_texts_count_where_a_result_may_hold_them(
    copy: Path, before: dict[str, str], file: str, old: str, new: str, reached: set[str]
) -> None:
    found = changed(before, copy, f"{PACKAGE}/{file}", lambda text: text.replace(old, new))
    assert found == reached


@pytest.mark.slow
def test_comments_and_docstrings_change_no_key(copy: Path, before: dict[str, str]) -> None:
    """In all modules at once: a comment above, one in each body, another docstring."""
    for file in (copy / PACKAGE).rglob("*.py"):
        text = file.read_text("utf-8")
        if text.startswith('"""'):
            text = '"""Another' + text[3:]
        text = re.sub(r'^( +)"""(?=\w)', r'\1# a comment\n\1"""Another ', text, flags=re.MULTILINE)
        file.write_text(f"# changed\n{text}\n# changed\n")
    after = keys(copy)
    shutil.rmtree(copy / PACKAGE)
    shutil.copytree(ROOT / PACKAGE, copy / PACKAGE)
    assert after == before


HELPER = """
def _why(n):
    hint = f"{n} of them" if n else ""
    return f"found {hint}" + ", expected 2"
def g():"""
OTHER_HELPER = HELPER.replace("of them", "such").replace("expected", "not")


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
        ('with one_line(where, "whole"): read()', 'with one_line(where, "all of it"): read()'),
        ('def f(): return SourceError(f"{a}: b")', 'def f(): return SourceError(f"c {a}")'),
        ('assert a, "b"', 'assert a, "c"'),
        ("def f():\n    b = 'c'\n    raise E(b)", "def f():\n    b = 'd'\n    raise E(b)"),
        (f"{HELPER}\n    raise E(_why(1))", f"{OTHER_HELPER}\n    raise E(_why(1))"),
        (
            f"{HELPER}\n    b = _why(1)\n    if b: raise E(b)",
            f"{OTHER_HELPER}\n    b = _why(1)\n    if b: raise E(b)",
        ),
        ('_A = "a"\ndef f(): raise E(_A)', '_A = "b"\ndef f(): raise E(_A)'),
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


# what may hold the text "a" beside a message
HOLDERS = [
    "b = {0}",
    "def f():\n    b = {0}\n    g(b)\n    raise E(b)",
    "def f():\n    b = {0}\n    if b == c: g()\n    raise E(b)",
    "def f():\n    b = c[{0}]\n    raise E(b)",
    "def f():\n    b = g({0})\n    raise E(b)",
    "def f():\n    b = [{0}]\n    raise E(b)",
    "def f():\n    b = {0} if c else d\n    return b",
    "def f():\n    b = {0}\n    if b: g()\n    return lambda: b",
    "def f():\n    global b\n    b = {0}\n    raise E(b)",
    "def f():\n    class C:\n        b = {0}\n    raise E(b)",
    "b = {0}\ndef f(): raise E(b)",
    "_b = {0}\ndef f(): raise E(_b)\ndef g(): return _b",
    "_b = {0}\ndef f(): raise E(_b)\ndef g(): return getattr(c, '_b')",
    "def b(): return {0}\ndef f(): raise E(b())",
    "def _b(): return {0}",
    "def _b(): return {0} if _b() else _b()",
    "def _b(): return {0}\ndef f(): raise E(_b())\ndef g(): return _b()",
    "def _b(c):\n    if c == {0}: return ''\n    return 'd'\ndef f():\n    if d := _b(): raise d",
    "def _b():\n    d = {0}\n    return d == c and c\ndef f():\n    if d := _b(): raise d",
    "@route\ndef _b(): return {0}\ndef f(): raise E(_b())",
    "class C(Base):\n    def _b(self): return {0}\n    def f(self): raise E(self._b())",
    "def f(): raise NoSurfaceError({0})",
    "def f():\n    b = {0}\n    raise NoSurfaceError(b)",
    "def f(): return Message({0})",
]


@pytest.mark.parametrize("holder", HOLDERS)
def test_a_text_that_more_than_a_message_may_hold_counts(holder: str) -> None:
    assert code(holder.replace("{0}", '"a"')) != code(holder.replace("{0}", '"b"'))


def test_whether_a_text_of_a_message_is_empty_counts() -> None:
    holder = "def f():\n    b = {0}\n    if b: raise E(b)"
    assert code(holder.replace("{0}", '"a"')) == code(holder.replace("{0}", '"b"'))
    assert code(holder.replace("{0}", '"a"')) != code(holder.replace("{0}", '""'))


@pytest.mark.slow
def test_no_module_uses_a_private_text_of_another() -> None:
    """Else the uses in its own module would not be all."""
    held, foreign = set(), set()
    for file in (ROOT / PACKAGE).rglob("*.py"):
        finder, tree = message_texts._Finder(), ast.parse(file.read_bytes())
        nodes = list(ast.walk(tree))
        functions = (ast.FunctionDef, ast.AsyncFunctionDef)
        defined = {node.name for node in nodes if isinstance(node, functions)}
        defined |= {
            node.attr if isinstance(node, ast.Attribute) else node.id
            for node in nodes
            if isinstance(node, ast.Attribute | ast.Name) and isinstance(node.ctx, ast.Store)
        }
        finder.visit(tree)
        names = {name for scope, name in finder.held_by_messages() if scope == 0}
        held |= {name for name in names if message_texts._is_private(name)}
        for node in nodes:
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("stereocell"):
                foreign |= {alias.name for alias in node.names}
            elif isinstance(node, ast.Attribute) and node.attr not in defined:
                foreign.add(node.attr)
    assert held
    assert not held & foreign


def code(text: str) -> str:
    return source_code.read_source(text.encode()).code


def test_only_libraries_that_can_change_a_byte_are_in_a_unit_s_key() -> None:
    _, libraries = cache_key._reach(unit.__name__, cache_key.NEUTRAL)
    _, of_window = cache_key._reach(window.__name__, cache_key.NEUTRAL)
    _, of_reader = cache_key._reach(ZARR, cache_key.NEUTRAL)
    named = {name for name, _ in (*libraries, *of_window, *of_reader)}
    assert {"numpy", "vtk", "edt", "zarr"} <= named
    others = {"alktx2", "pymeshlab", "xatlas"}  # of extras: in the keys of the builds that use them
    others |= {"aiohttp", "botocore", "psutil", "jsonschema", "distributed", "rich", "pydicom"}
    assert not others & named


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
        ("bioio_*", {"bioio"}),
    ],
)
def test_what_decodes_for_a_reader_is_in_its_key_alone(library: str, readers: set[str]) -> None:
    modules = {name: reader.module for name, reader in READERS.items()} | {"bioio": OTHER.module}
    found = {
        name
        for name, module in modules.items()
        if library in dict(cache_key._reach(module, cache_key.NEUTRAL)[1])
    }
    assert found == readers
    assert library not in dict(cache_key._reach(unit.__name__, cache_key.NEUTRAL)[1])


def test_another_version_of_a_decoder_or_its_lack_makes_another_key(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def of_readers() -> dict[str, str]:
        cache_key._reach.cache_clear()
        cache_key._digest.cache_clear()
        return {name: cache_key.key_of("", reader.module) for name, reader in READERS.items()}

    installed, there = cache_key._distributions(), of_readers()

    class Older:
        metadata: ClassVar = {"Name": "liffile", "Version": "1"}

    for changed_one in ({"liffile": (Older(),)}, {}):
        known = {name: one for name, one in installed.items() if name != "liffile"} | changed_one
        monkeypatch.setattr(cache_key, "_distributions", lambda known=known: known)
        now = of_readers()
        assert {name for name in there if now[name] != there[name]} == {"lif"}
        there["lif"] = now["lif"]
    assert "liffile" not in cache_key.libraries_of(READERS["lif"].module)
    monkeypatch.undo()
    assert of_readers()["lif"] != there["lif"]


def test_modules_that_are_left_out_exist() -> None:
    for part in cache_key.NEUTRAL:
        assert f"stereocell.{part}" in cache_key._modules(), part


def test_versions_of_libraries_count_those_of_lone_extension_modules_too() -> None:
    assert {"numpy", "vtk", "edt", "zarr"} <= cache_key.libraries_of(unit, window, ZARR).keys()
    assert {"usd-core", "OpenEXR"} <= cache_key.libraries_of(stage_tasks).keys()


@pytest.mark.slow
def test_packages_are_found_as_python_finds_them() -> None:
    found = cache_key._distributions()
    for top, names in packages_distributions().items():
        assert {package.name for package in found[top]} == set(names), top


BESIDE = {"bioio", "bioio_base"}  # a user has them beside StereoCell (read/bioio_image.py)


@pytest.mark.slow
def test_what_is_imported_is_declared() -> None:
    """A package that comes along with another one is gone when that one does without it."""
    declared = {canonicalize_name(Requirement(line).name) for line in requires("stereocell") or ()}
    installed = cache_key._distributions()
    for file in (ROOT / "pipeline" / "stereocell").rglob("*.py"):
        for name in cache_key._needs(file)[1]:
            top = name.split(".")[0]
            if top not in {*sys.stdlib_module_names, "stereocell", *BESIDE}:
                owners = {canonicalize_name(package.name) for package in installed[top]}
                assert owners & declared, f"{file.name} imports {top}"

"""The docs work as they are printed: code, commands, links, tables, the workflow.

Every `stereocell` in a block of the README or of docs/ is run, in the order of the pages. One
folder has small sources under the names that the docs use. Commands in PARSED are only parsed by
the program's own parser, `make` by `make -n`, and `dask` is compared with its own help.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
import yaml

import stereocell
from stereocell import samples
from stereocell.building.out_folder import OutFolder
from stereocell.cli import __main__ as cli
from stereocell.engine.run import Engine
from stereocell.model.errors import UsageError
from stereocell.read import formats
from stereocell.read.known_formats import known_formats
from stereocell.report import phase as drawing
from stereocell.samples.head import make_head
from stereocell.samples.head_dicom import write_dicom
from stereocell.storage.json_files import write_sealed
from support import phantoms
from support.dicom_series import write_enhanced, write_f_nifti, write_series

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
FIRST = [DOCS / name for name in ("index.md", "own-data.md", "blender.md")]  # the others need these
PAGES = [*FIRST, *sorted({*DOCS.rglob("*.md"), ROOT / "README.md"} - set(FIRST))]

# Commands that are only parsed: what they need that is not available here, and where they are run
PARSED = {
    "view": "does not end: serve/test_server.py",
    "serve": "does not end: serve/test_server.py, serve/test_brick_session.py",
    "tissue": "half a minute: building/test_tissue.py",
    "build big.ome.zarr": "a cluster: engine/test_cluster.py",
    "publish out/mine s3://": "object storage: publish/test_publish.py",
    "publish out/mine ../pages": "another host: the same",
    "build s3://": "object storage: storage/test_object_store.py",
    "build stack.tif": "masks of another program: building/test_objects.py",
    "build store.zarr": "the same: read/tables/test_tables.py",
    "build ct.nii.gz": "the same: planning/test_label_maps.py",
    "build CT_FOLDER": "the same: read/formats/dicom/test_segmentation.py",
    "build seg.dcm": "the same",
}
# Parts of commands that are run on less data
SMALLER = {
    "sample cycif sample.ome.zarr": "sample cycif sample.ome.zarr --grid 1x1 --tile-size 8,64,64",
    "--grid 5x2": "--grid 2x1",
    "--tile r1_c2": "--tile r0_c0",
}


def blocks(page: Path, language: str = r"\w*") -> list[str]:
    """Return the texts of the page's code blocks."""
    return re.findall(
        rf"^ *```{language}\n(.*?)^ *```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE
    )


def commands(page: Path, program: str) -> Iterator[str]:
    """Yield the page's commands of a program, without a prompt and without remarks."""
    for block in blocks(page):
        for line in block.splitlines():
            if found := re.match(rf"(?:\$ )?(?:\.venv/bin/)?({program} .*)", line):
                yield re.split(r"\s+#|\s{3,}", found[1])[0]


def is_parsed_only(command: str) -> bool:
    return any(command.startswith(f"stereocell {start}") for start in PARSED)


def parse(command: str) -> Any:
    """Return the command's options. The test fails if the program refuses the command."""
    try:
        return cli._parser().parse_args(shlex.split(command.partition(" > ")[0])[1:])
    except UsageError as error:
        pytest.fail(f"not a command of this version: {command}: {error}")


@pytest.fixture
def sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with sources and the files that the pages ask the reader to write."""
    monkeypatch.chdir(tmp_path)
    body = phantoms.f_phantom()
    voxels = np.stack([body, body[:, :, ::-1]])
    names = ["CD31", "MART1"]
    phantoms.write_ome_tiff(tmp_path / "my.ome.tif", voxels, "CZYX", names=names)
    labels = [{"label": name, "color": "00FF80"} for name in names]
    phantoms.write_ome_zarr(tmp_path / "my.ome.zarr", [voxels], "czyx", channels=labels)
    write_dicom(tmp_path / "scans" / "head", make_head(shape=(24, 20, 22), seed=4), seed=4)
    write_series(tmp_path / "scans" / "head" / "other", np.diag([3.0, 3, 3, 1]), (9, 12, 14))
    write_enhanced(tmp_path / "frames.dcm", np.diag([3.0, 3, 3, 1]), (9, 12, 14))
    write_f_nifti(tmp_path / "brain.nii.gz", body, (500, 200, 200))
    spaced = {"spacing": 0.5, "unit": "um"}
    for name, axes, stored in (
        ("film", "TYX", body), ("cells", "TZYX", voxels.transpose(1, 0, 2, 3)),
    ):  # fmt: skip
        tifffile.imwrite(
            tmp_path / f"{name}.tif", stored, imagej=True, resolution=(5.0, 5.0),
            metadata={"axes": axes, **spaced},
        )  # fmt: skip
    (tmp_path / "planes").mkdir()
    for c, z in np.ndindex(voxels.shape[:2]):
        tifffile.imwrite(tmp_path / "planes" / f"img_c{c}_z{z}.tif", voxels[c, z])
    for name in ("edited.usda", "edits.usda"):
        (tmp_path / name).write_text(blocks(DOCS / "blender.md", "usda")[0])
    (tmp_path / "organoid.toml").write_text(blocks(DOCS / "extending.md", "toml")[0])
    return tmp_path


@pytest.mark.slow
def test_commands_run(
    sources: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    report: Callable[[Path, Engine], None] = drawing.run_report
    drawn: list[Path] = []

    def draw(
        out: Path, engine: Engine, **_: bool
    ) -> None:  # seconds each time: the first that is built, and where asked for
        if not drawn or command.startswith("stereocell report "):
            report(out, engine)
            drawn.append(out)
        else:  # an earlier report is not one of this build
            folder = OutFolder(out)
            others = {name: one for name, one in folder.phases().items() if name != "report"}
            write_sealed(folder.phases_file, others)

    monkeypatch.setattr(drawing, "run_report", draw)
    of_few = partial(samples.write_cells, shape=(24, 60, 60))  # all 1500 take seconds
    monkeypatch.setattr(samples, "write_cells", of_few)
    ran = []
    for page in PAGES:
        for command in commands(page, "stereocell"):
            options = parse(command)
            if is_parsed_only(command):
                continue
            for given, smaller in SMALLER.items():
                command = command.replace(given, smaller)
            if hasattr(options, "workers"):
                command += " --workers 0"
            words, _, file = command.partition(" > ")
            with (
                open(sources / (file or "stdout.txt").split()[0], "w") as stdout,
                redirect_stdout(stdout),
            ):
                code = cli.main(shlex.split(words)[1:])
            assert code == 0, f"{page.name}: {command}: {capsys.readouterr().err}"
            ran.append(options.command)
    # Only commands in PARSED are left out.
    assert set(ran) == set(cli.COMMANDS) - {"view", "serve", "tissue"}
    reports = [c for p in PAGES for c in commands(p, "stereocell")].count(
        "stereocell report out/mine"
    )
    assert drawn == [Path("out/sample"), *[Path("out/mine")] * reports]
    for folder in ("head", "second", "frames", "brain"):  # builds of the page about DICOM
        assert (sources / f"out/{folder}/bundle/manifest.json").is_file()
    assert (sources / "out/sample/report/index.html").is_file()
    assert (sources / "out/mine/report/index.html").is_file()
    _runs_the_workflow(sources)


def _runs_the_workflow(folder: Path) -> None:
    """Run the last step of the example for CI in a shell, as a runner does."""
    workflow = yaml.safe_load((DOCS / "examples" / "check-bundle.yml").read_text("utf-8"))
    job = workflow["jobs"]["check"]
    *_, install, check = job["steps"]
    assert (
        install["run"] == "pip install wheels/stereocell-*.whl"
    )  # as system/test_empty_environment.py
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    command = ["bash", "-e", "-c", check["run"]]
    answer = subprocess.run(
        command, cwd=folder, env={**os.environ, **job["env"], "PATH": path}, check=False
    )
    assert answer.returncode == 0
    (folder / "out/mine/bundle/manifest.json").write_text("{}")
    answer = subprocess.run(
        command, cwd=folder, env={**os.environ, **job["env"], "PATH": path}, check=False
    )
    assert answer.returncode == 1


@pytest.mark.slow
def test_commands_in_sentences_and_commands_that_are_not_run_are_parsed() -> None:
    used = set()
    for page in PAGES:
        spans = re.findall(r"`(?:\.venv/bin/)?(stereocell [a-z]+ [^`]+)`", page.read_text("utf-8"))
        for command in [*commands(page, "stereocell"), *spans]:
            if "..." not in command:
                parse(" ".join(command.split()))
            used |= {start for start in PARSED if command.startswith(f"stereocell {start}")}
    assert used == set(PARSED)  # every entry of PARSED is still in the docs


@pytest.mark.slow
def test_commands_of_other_programs_are_run_by_other_tests() -> None:
    """docs/test_cluster_page.py runs `dask`, `mkdir`, `python` and `export`, and
    system/test_empty_environment.py runs `pip install` of a wheel.

    `uvx` and `pipx` would install everything again from an index; each here only asks for help.
    """
    found = {line for page in PAGES for block in blocks(page, "sh") for line in block.splitlines()}
    others = {line.split()[0] for line in found if line.strip() and line.lstrip()[0] != "#"}
    others -= {"stereocell", ".venv/bin/stereocell", "make"}
    assert others == {"dask", "export", "mkdir", "pip", "python", "uvx", "pipx"}
    printed = " ".join(line for line in found if line.startswith("dask "))
    for command in ("scheduler", "worker"):
        takes = subprocess.run(
            [sys.executable, "-m", "dask", command, "--help"], capture_output=True, text=True
        ).stdout
        (line,) = re.findall(rf"dask {command} (.*?)(?:\s{{3,}}#|$|dask)", printed)
        flags = re.findall(r"--[a-z-]+", line)
        assert flags
        assert all(re.search(rf"{flag}\b", takes) for flag in flags), line


def test_python_in_the_docs_compiles() -> None:
    for page in PAGES:
        for text in blocks(page, "python"):
            compile(text, str(page), "exec")


@pytest.mark.slow
def test_targets_exist() -> None:
    if shutil.which("make") is None:
        pytest.skip("no make")
    found = {command for page in PAGES for command in commands(page, "make")}
    assert len(found) >= 7
    for command in sorted(found):
        words = shlex.split(command)
        answer = subprocess.run(
            [words[0], "-n", *words[1:]], cwd=ROOT, capture_output=True, text=True, check=False
        )
        assert answer.returncode == 0, f"{command}: {answer.stderr}"


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_python_runs(sources: Path) -> None:
    texts = blocks(DOCS / "python.md", "python")
    assert len(texts) == 3
    names: dict[str, object] = {}
    for text in texts:
        exec(compile(text, "docs/python.md", "exec"), names)
    assert (sources / "out" / "python" / "bundle" / "manifest.json").is_file()


def test_the_printed_reader_works_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cube.py").write_text(blocks(DOCS / "extending-reader.md", "python")[0])
    monkeypatch.setattr(formats, "__path__", [*formats.__path__, str(tmp_path)])
    known_formats.cache_clear()
    try:
        body = phantoms.f_phantom().astype(np.uint8)
        path = tmp_path / "f.cube"
        path.write_bytes(" ".join(map(str, body.shape)).encode() + b"\n" + body.tobytes())
        dataset = stereocell.open_volume(path, spacing_um=(0.5, 0.2, 0.2))
        assert dataset.name == "f"
        assert (dataset.read(0, dataset.levels[0].box, 0).voxels == body).all()
        # The record of steps lacks the reader still.
        out = tmp_path / "out"
        assert cli.main(["plan", str(path), "-o", str(out), "--spacing-um", "0.5,0.2,0.2"]) == 0
        made = json.loads((out / "provenance.json").read_bytes())
        assert "numpy" in made["libraries"]
        path.write_bytes(b"4 4\n" + body.tobytes())
        with pytest.raises(stereocell.StereoCellError, match="expected z, y, x"):
            stereocell.open_volume(path)
        path.write_bytes(b"<html>")
        with pytest.raises(stereocell.StereoCellError, match=r"an HTML page .* expected Cube"):
            stereocell.open_volume(path)
    finally:
        known_formats.cache_clear()
        sys.modules.pop("stereocell.read.formats.cube", None)


def test_named_functions_exist() -> None:
    text = (DOCS / "python.md").read_text("utf-8")
    named = re.findall(r"`([a-z][\w.]*)\.(\w+)`", text.partition("| step |")[2])
    assert len(named) > 12
    for module, function in named:
        assert callable(getattr(import_module(f"stereocell.{module}"), function))


def test_named_files_exist() -> None:
    path = re.compile(r"`((?:tests|schemas|usd_assets|pipeline|viewer_gltf)/[\w/.]+)`")
    for page in PAGES:
        for name in path.findall(page.read_text("utf-8")):
            assert (ROOT / name).exists(), f"{page.name}: {name}"


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page that GitHub and the site both know."""
    text = re.sub(r"(?ms)^ *```.*?^ *```", "", page.read_text("utf-8"))
    found = set(re.findall(r'<a id="([\w-]+)">', text))
    for title in re.findall(r"^#+ (.*)$", text, re.MULTILINE):
        plain = re.sub(r"[^\w\s-]", "", title.lower()).strip()
        if "  " not in plain:  # the site joins two spaces, GitHub does not
            found.add(plain.replace(" ", "-"))
    return found


def test_links_lead_to_files_and_headings_of_the_repository() -> None:
    known: dict[Path, set[str]] = {}
    for page in PAGES:
        text = re.sub(r"(?ms)^ *```.*?^ *```", "", page.read_text("utf-8"))
        for target, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)]*))?\)", text):
            if "://" in target:
                continue
            path = (page.parent / target).resolve() if target else page
            assert path.exists(), f"{page.name}: {target}"
            if anchor:
                known.setdefault(path, anchors(path))
                assert anchor in known[path], f"{page.name}: {target}#{anchor}"


def test_links_to_pages_that_are_made_lead_to_them_in_the_site(reference: Any) -> None:
    made = {*reference.pages(), "notebook.md"}
    assert set(reference.TARGETS.values()) == made
    text = "[a](reference.md#settings), [b](../reference.md#plan), [c](reference.md)"
    assert reference.with_made_pages(text, "one.md") == (
        "[a](settings.md), [b](formats/plan.md), [c](reference.md)"
    )
    assert "](../formats/plan.md)" in reference.with_made_pages(text, "formats/index.md")
    shown = re.findall(r"reference\.md#([\w-]+)", (DOCS / "reference.md").read_text("utf-8"))
    assert set(shown) == set(reference.TARGETS)


def test_every_field_of_every_schema_is_in_the_reference(reference: Any) -> None:
    def names(schema: Any) -> Iterator[str]:
        if isinstance(schema, dict):
            yield from schema.get("properties", ())
            for value in schema.values():
                yield from names(value)
        elif isinstance(schema, list):
            for value in schema:
                yield from names(value)

    pages = reference.pages()
    shown = "\n".join(pages.values())
    for path in sorted((ROOT / "schemas").glob("*.json")):
        for name in names(json.loads(path.read_bytes())):
            assert re.search(rf"`[^`\n]*{re.escape(name)}`", shown), f"{path.name}: {name}"
    for name in cli.COMMANDS:
        assert f"usage: stereocell {name} " in pages["commands.md"]
    row = "| `lods[].distance_um` | number, at least 0 |"
    assert row in pages["formats/units.md"]
    assert "| `plan` |" not in pages["formats/plan.md"]


@pytest.fixture(scope="module")
def reference() -> Any:
    """docs/reference.py, as MkDocs loads it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(DOCS))
        return import_module("reference")

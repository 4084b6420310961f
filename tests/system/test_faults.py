"""A build's source, OUT or store fails and comes back: one line, and then the same bytes."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from shutil import which
from threading import Event, Thread
from typing import Any

import fsspec
import pytest
from aiohttp import ClientTimeout

from stereocell import read
from stereocell.building import find_survey, phases
from stereocell.cli.__main__ import main
from stereocell.model.errors import SourceError
from stereocell.storage import location
from stereocell.storage.http_hosts import checks
from stereocell.storage.location import Location
from support import phantoms
from support.error_lines import error_line
from support.faulty_object_store import FAULTS, Faults, before
from support.object_store import ObjectStore, serving
from support.torture import asset_digests
from support.validators import make_assets

GRID = "2x1"
Fixture = tuple[ObjectStore, Faults]


@pytest.fixture(scope="module")
def volume(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("volume") / "f.ome.zarr"
    return phantoms.write_ome_zarr(path, [phantoms.f_phantom()])


@pytest.fixture(scope="module")
def undisturbed(volume: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    assert make_assets(volume, out, GRID, "--workers", "0") == 0
    return assets(asset_digests(out))


def assets(digests: dict[str, str]) -> dict[str, str]:
    """Return the digests of stage and bundle, which do not depend on the source's name."""
    return {name: digest for name, digest in digests.items() if not name.startswith("units/")}


@pytest.mark.slow
def test_missing_source_is_named_and_the_build_goes_on_after_its_return(
    volume: Path,
    undisturbed: dict[str, str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    away, out = volume.with_name("away"), tmp_path / "out"
    save = find_survey.save_survey

    def vanish(*arguments: Any) -> None:
        save(*arguments)
        volume.rename(away)

    monkeypatch.setattr(find_survey, "save_survey", vanish)
    assert make_assets(volume, out, GRID, "--workers", "0") == 1
    assert "f.ome.zarr: " in error_line(capsys)
    assert not list(out.rglob("unit.json"))
    monkeypatch.undo()
    away.rename(volume)
    assert make_assets(volume, out, GRID, "--workers", "0") == 0
    assert assets(asset_digests(out)) == undisturbed


@pytest.mark.exhaustive
def test_source_that_vanishes_under_workers_is_named_and_units_are_made_after_its_return(
    volume: Path, tmp_path: Path
) -> None:
    grid, away, out = "3x2", volume.with_name("away"), tmp_path / "out"
    assert make_assets(volume, tmp_path / "whole", grid, "--workers", "0") == 0
    command = [sys.executable, "-m", "stereocell.cli", "build", str(volume), "-o", str(out)]
    flags = ["--grid", grid, "--workers", "2"]
    build = subprocess.Popen([*command, *flags], stderr=subprocess.PIPE, text=True)
    while build.poll() is None and not list(out.glob("units/r*/*/*/unit.json")):
        time.sleep(0.01)
    volume.rename(away)
    _, printed = build.communicate()
    away.rename(volume)
    assert build.returncode == 1, printed
    assert "Traceback" not in printed
    lines = [line for line in printed.splitlines() if line.startswith("stereocell: ")]
    assert lines
    assert all("f.ome.zarr: " in line or " failed" in line for line in lines), lines
    # A missing source can't be compared, so units that were made from it are not kept either.
    assert "no result of this pass is kept" in printed
    assert not list(out.glob("units/r*/*/*/unit.json"))
    assert make_assets(volume, out, grid, "--workers", "0") == 0
    assert asset_digests(out) == asset_digests(tmp_path / "whole")


@pytest.mark.slow
def test_a_read_only_out_is_named_and_the_build_goes_on_when_it_can_be_written(
    volume: Path,
    undisturbed: dict[str, str],
    small_disk: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def remount(options: str) -> None:
        subprocess.run(["mount", "-o", f"remount,{options}", str(small_disk)], check=True)

    out = small_disk / "out"
    remount("size=64m")
    for phase in (["plan", str(volume), "-o", str(out), "--grid", GRID], ["units", str(out)]):
        remount("ro")
        assert main(phase) == 1
        line = error_line(capsys)
        assert str(out) in line
        assert "Read-only file system" in line
        remount("rw")
        assert main([*phase, *(["--workers", "0"] if phase[0] == "units" else [])]) == 0
    assert make_assets(volume, out, GRID, "--workers", "0") == 0
    assert assets(asset_digests(out)) == undisturbed


# The command: killed, or with an OUT that can't be written, once the first tile of a phase is done
IN_THE_MIDDLE = """
import os, signal, sys
from pathlib import Path
from stereocell.building import find_survey, phases
from stereocell.engine import run as engine
from stereocell.cli.__main__ import main

phase, out, fault, viewer = sys.argv[1:5]
phases.viewer_dist = lambda: Path(viewer)  # the same as in the process of the tests
tell = engine.console.print

def befall(text, **how):
    tell(text, **how)
    if text.startswith(f"{phase}: 1/"):
        if fault == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        for folder, *_ in os.walk(out):
            os.chmod(folder, 0o555)

engine.console.print = befall
sys.exit(main([phase, out, "--workers", "0"]))
"""
# Takes from root the capability to write anywhere.
BOUND = ("setpriv", "--bounding-set=-dac_override") if os.geteuid() == 0 else ()


def in_the_middle_of(phase: str, out: Path, fault: str) -> list[str]:
    """Return a command that runs a phase, in which the fault happens once the first task is done.

    fault  "killed", or "read-only": OUT can't be written

    The command copies the viewer of the tests' process.
    """
    viewer = str(phases.viewer_dist())
    return [sys.executable, "-c", IN_THE_MIDDLE, phase, str(out), fault, viewer]


@pytest.mark.exhaustive
@pytest.mark.skipif(bool(BOUND) and which(BOUND[0]) is None, reason="root without setpriv")
def test_an_out_that_becomes_read_only_within_a_phase_is_named_and_the_phase_goes_on(
    volume: Path, undisturbed: dict[str, str], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    assert main(["plan", str(volume), "-o", str(out), "--grid", GRID]) == 0
    for phase in ("units", "stage", "bundle"):
        command = [*BOUND, *in_the_middle_of(phase, out, "read-only")]
        ended = subprocess.run(command, capture_output=True, text=True)
        assert ended.returncode == 1, ended.stderr
        (line,) = [line for line in ended.stderr.splitlines() if line.startswith("stereocell: ")]
        assert str(out) in line
        assert "Permission denied" in line
        # The lock can\'t be removed either, but the line should name the first failure.
        assert "/.lock" not in line
        assert "Traceback" not in ended.stderr
        finished = {file: file.stat().st_mtime_ns for file in out.glob("units/r*/*/*/*")}
        assert finished
        for folder, *_ in os.walk(out):
            os.chmod(folder, 0o755)
        assert main([phase, str(out), "--workers", "0"]) == 0
        assert {file: file.stat().st_mtime_ns for file in finished} == finished
    assert assets(asset_digests(out)) == undisturbed
    assert not [path for path in out.rglob(".*") if path.name != ".nojekyll"]


@pytest.mark.slow
def test_finished_parts_of_stage_and_bundle_are_not_made_again(
    volume: Path, undisturbed: dict[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["plan", str(volume), "-o", str(out), "--grid", GRID]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    for phase, record in (("stage", "part.json"), ("bundle", "tile.json")):
        ended = subprocess.run(in_the_middle_of(phase, out, "killed"), check=False)
        assert ended.returncode == -signal.SIGKILL
        (part,) = (file.parent for file in out.glob(f"{phase}_parts/**/{record}"))
        files = [file for file in part.rglob("*.*") if file.name != record]
        finished = {(file.name, file.stat().st_mtime_ns) for file in files}
        assert len(finished) >= 2  # a part of the stage has two files of voxels
        capsys.readouterr()
        assert main([phase, str(out), "--workers", "0"]) == 0
        (printed,) = [one for one in capsys.readouterr().err.splitlines() if f"{phase}: 1/" in one]
        assert printed.startswith(f"{phase}: 1/1 r0_c")
        whole = {(file.name, file.stat().st_mtime_ns) for file in (out / phase).rglob("*.*")}
        assert finished <= whole
    assert not [*out.glob("*_parts")]
    assert assets(asset_digests(out)) == undisturbed


@pytest.mark.exhaustive
def test_a_finished_tile_that_is_damaged_or_of_other_settings_is_made_again(
    volume: Path, undisturbed: dict[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert make_assets(volume, out, GRID, "--workers", "0") == 0
    (grid,) = out.glob("stage/tiles/r0_c1/*.vdb")
    grid.write_bytes(b"cut")
    capsys.readouterr()
    assert main(["stage", str(out), "--workers", "0"]) == 0
    assert "stage: 1/1 r0_c1/" in capsys.readouterr().err
    subprocess.run(in_the_middle_of("bundle", out, "killed"), check=False)
    (part,) = (file.parent for file in out.glob("bundle_parts/**/tile.json"))
    next(part.rglob("*.glb")).write_bytes(b"cut")
    capsys.readouterr()
    assert main(["bundle", str(out), "--workers", "0"]) == 0
    assert "bundle: 2/2" in capsys.readouterr().err
    assert assets(asset_digests(out)) == undisturbed


@pytest.fixture(scope="module")
def store(
    volume: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[ObjectStore, Faults]]:
    with (
        serving(tmp_path_factory.mktemp("objects")) as store,
        before(store.endpoint) as faults,
        pytest.MonkeyPatch.context() as patch,
    ):
        through = ObjectStore(store.kind, faults.endpoint)
        for name, value in through.environment.items():
            patch.setenv(name, value)
        fs = through.files()
        fs.mkdir("bucket")
        fs.put(str(volume), "bucket/f.ome.zarr", recursive=True)
        yield through, faults


def kept(store: ObjectStore, out: str, folder: Path) -> dict[str, str]:
    store.files().get(out, str(folder), recursive=True)
    return assets(asset_digests(folder))


@pytest.mark.exhaustive
def test_store_that_fails_now_and_then_gets_further_requests(
    store: Fixture, undisturbed: dict[str, str], tmp_path: Path
) -> None:
    files, faults = store
    faults.seen.clear()
    faults.rate = 0.15
    try:
        code = make_assets("s3://bucket/f.ome.zarr", "s3://bucket/often", GRID, "--workers", "0")
    finally:
        faults.rate = 0
    assert code == 0
    assert set(FAULTS) <= faults.seen.keys()
    assert kept(files, "bucket/often", tmp_path / "often") == undisturbed


@pytest.mark.slow
def test_a_store_that_is_down_is_named_and_the_build_goes_on_when_it_is_up(
    store: Fixture,
    undisturbed: dict[str, str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    files, faults = store
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    source, out = "s3://bucket/f.ome.zarr", "s3://bucket/down"
    assert main(["plan", source, "-o", out, "--grid", GRID]) == 0
    for kind in ("503", "cut"):
        capsys.readouterr()
        faults.rate, faults.only = 1.0, (kind,)
        try:
            assert main(["units", out, "--workers", "0"]) == 1
        finally:
            faults.rate, faults.only = 0, FAULTS
        assert "s3://bucket/" in error_line(capsys)
    assert make_assets(source, out, GRID, "--workers", "0") == 0
    assert kept(files, "bucket/down", tmp_path / "down") == undisturbed


@pytest.fixture
def silent(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The address of a host that accepts connections and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        host = f"127.0.0.1:{server.getsockname()[1]}"
        # fsspec caches file systems by their settings. New settings make one with this endpoint.
        storage_options = {"anon": True, "config_kwargs": {"user_agent_extra": host}}
        monkeypatch.setitem(fsspec.config.conf, "s3", storage_options)
        yield host


@pytest.mark.parametrize("source", ["s3://b/f.ome.zarr", "http://HOST/f.ome.zarr", ""])
def test_silent_store_is_reported_in_one_line(
    source: str,
    silent: str,
    volume: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://{silent}")
    monkeypatch.setattr(location, "ANSWER_S", 1.0)
    source = source.replace("HOST", silent)
    out = tmp_path / "out" if source else "s3://b/out"
    assert main(["plan", source or str(volume), "-o", str(out)]) == 1
    where = source or out
    assert error_line(capsys).startswith(f"stereocell: {where}: no answer within ")


class Moody(SimpleHTTPRequestHandler):
    """Serves files; those of the finest level slowly, and not at all after `is_hushed` is set."""

    is_hushed = Event()
    is_over = Event()

    def copyfile(self, source: Any, outputfile: Any) -> None:
        if "/0/" not in self.path:
            return super().copyfile(source, outputfile)
        if self.is_hushed.is_set():
            self.is_over.wait(30)
            return
        content = source.read()
        for part in range(8):
            outputfile.write(content[len(content) * part // 8 : len(content) * (part + 1) // 8])
            outputfile.flush()
            time.sleep(0.5)  # far less than the 3 s that count as silence, because cores are shared

    def log_message(self, *_: object) -> None:
        pass


def test_a_web_host_may_be_slow_but_not_silent(
    volume: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(location, "SILENCE_S", 3.0)
    Moody.is_hushed.clear()
    Moody.is_over.clear()
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Moody, directory=str(volume.parent)))
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    source = f"http://127.0.0.1:{server.server_address[1]}/{volume.name}"
    try:
        begin = time.monotonic()
        dataset = read.open(source)  # the array's metadata come slowly, too
        dataset.read(0, dataset.levels[0].box)
        assert time.monotonic() - begin > 6.0
        Moody.is_hushed.set()
        with pytest.raises(SourceError, match=r"f\.ome\.zarr.*did not answer within 3 s"):
            dataset.read(0, dataset.levels[0].box)
    finally:
        Moody.is_over.set()
        server.shutdown()
        server.server_close()
        thread.join()


def test_users_settings_of_web_clients_take_precedence(monkeypatch: pytest.MonkeyPatch) -> None:
    client_options = {"timeout": ClientTimeout(total=7), "trust_env": True}
    monkeypatch.setitem(fsspec.config.conf, "http", {"client_kwargs": client_options})
    options = Location.of("https://a/b.ome.zarr").storage_options["client_kwargs"]
    assert options == {**client_options, "trace_configs": checks()}

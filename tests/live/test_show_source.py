"""`stereocell view SOURCE` shows a source at once, and leaves nothing behind."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path

import pytest

from stereocell.cli.__main__ import main
from stereocell.live.is_source import is_source
from support.digests import digests_of
from support.phantoms import f_phantom, write_ome_tiff
from support.server.timeouts import connect


@pytest.mark.slow
def test_a_source_is_served_until_ctrl_c_and_its_folder_is_removed(tmp_path: Path) -> None:
    source = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(2), spacing=(1.0, 0.5, 0.5))
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    command = [
        sys.executable,
        "-m",
        "stereocell.cli",
        "view",
        str(source),
        "--json",
        "--no-browser",
        "--no-build",
    ]
    with subprocess.Popen(
        [*command, "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(scratch)},
    ) as server:
        assert server.stdout is not None
        try:
            address = json.loads(server.stdout.readline())["address"]
            with urllib.request.urlopen(f"{address}manifest.json") as answer:
                manifest = json.load(answer)
            assert manifest["specimen"]["name"] == "f"
            assert manifest["channels"][0]["tileset"] is None
            with urllib.request.urlopen(address) as answer:
                assert b"<html" in answer.read()
            assert len(list(scratch.iterdir())) == 1
        finally:
            server.send_signal(signal.SIGINT)
            _, printed = server.communicate(timeout=60)
    assert server.returncode == 0
    assert "first view of f after" in printed
    assert list(scratch.iterdir()) == []
    assert sorted(tmp_path.iterdir()) == [source, scratch]


@pytest.mark.slow
def test_a_stopped_build_goes_on_behind_the_page_and_a_finished_one_is_shown(
    tmp_path: Path,
) -> None:
    source = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(2), spacing=(1.0, 0.5, 0.5))
    command = [sys.executable, "-m", "stereocell.cli", "serve", str(source), "--json"]
    command += ["--port", "0", "--out", "out", "--tile-size", "32,48,72"]
    for is_stopped in (True, False):
        with subprocess.Popen(
            command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        ) as server:
            assert server.stdout is not None
            try:
                address = json.loads(server.stdout.readline())["address"]
                with connect(address.replace("http", "ws", 1) + "live") as socket:
                    while not is_stopped or not (tmp_path / "out" / "plan.json").exists():
                        if json.loads(socket.recv())["doing"] == "complete":
                            break
            finally:
                server.send_signal(signal.SIGTERM)
                server.communicate(timeout=120)
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as server:
        assert server.stdout is not None
        try:
            address = json.loads(server.stdout.readline())["address"]
            with urllib.request.urlopen(f"{address}manifest.json") as answer:
                assert json.load(answer)["channels"][0]["tileset"] is not None
                assert "Stereocell-Live" not in answer.headers
        finally:
            server.send_signal(signal.SIGTERM)
            _, printed = server.communicate(timeout=60)
    assert "showing the finished build in out" in printed
    assert main(["build", str(source), "-o", str(tmp_path / "plain"), *command[-2:]]) == 0
    # The build of this process has a small viewer, so the pages differ, and are not compared.
    for part in ("stage", "bundle/channels", "bundle/volumes", "bundle/luts"):
        assert digests_of(tmp_path / "out" / part) == digests_of(tmp_path / "plain" / part)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_while_the_build_starts_prints_no_traceback(tmp_path: Path) -> None:
    source = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(2), spacing=(1.0, 0.5, 0.5))
    command = [sys.executable, "-m", "stereocell.cli", "serve", str(source), "--port", "0"]
    both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    with subprocess.Popen(
        command, cwd=tmp_path, text=True, start_new_session=True, **both
    ) as server:
        assert server.stdout is not None
        expected = {"building surfaces into", "Ctrl+C ends it"}  # in either order
        while expected and (line := server.stdout.readline()):
            expected = {words for words in expected if words not in line}
        os.killpg(server.pid, signal.SIGINT)  # as a terminal does
        printed = server.stdout.read()
    assert server.returncode == 0
    assert "Traceback" not in printed
    assert "stopped" not in printed  # the user, who pressed Ctrl+C, need not be informed


def test_sources_are_distinguished_from_builds_and_bundles(tmp_path: Path) -> None:
    source = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom())
    build, bundle, planes = (tmp_path / name for name in ("out", "sent", "planes"))
    build.mkdir()
    (build / "plan.json").write_text('{"format": "stereocell-plan"}')
    bundle.mkdir()
    for name in ("manifest.json", "files.json"):
        (bundle / name).write_text("{}")
    (bundle / "channels").mkdir()
    planes.mkdir()
    (planes / "0001.png").write_bytes(b"\x89PNG")
    assert is_source(source)
    assert is_source(planes)
    assert is_source("https://host/any")
    assert is_source("s3://bucket/image.ome.zarr")
    assert is_source(tmp_path / "missing.nii.gz")
    assert not is_source(build)
    assert not is_source(bundle)
    assert not is_source(tmp_path / "missing")
    assert not is_source("s3://bucket/out")
    assert not is_source(Path(tempfile.mkdtemp(dir=tmp_path)))


def test_flags_of_a_source_are_refused_for_a_build(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "plan.json").write_text('{"format": "stereocell-plan"}')
    for command in ("view", "serve"):
        assert main([command, str(tmp_path), "--channels", "CD31"]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line == (
            f"stereocell: --channels sets how a volume is read, but {tmp_path} is a build: "
            "leave it out, or name the volume"
        )

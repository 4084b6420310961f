"""Under a limit of the address space (`ulimit -v`), commands end with one line about memory."""

import errno
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from stereocell.cli import __main__ as cli
from stereocell.engine.run import Engine, TasksFailedError
from stereocell.model.errors import SourceError, StereoCellError
from stereocell.storage import processes
from stereocell.storage.library_errors import one_line
from stereocell.storage.processes import require_address_space, shortage
from support.phantoms import f_phantom, write_ome_zarr

ERRORS = (
    MemoryError(),
    RuntimeError("can't start new thread"),
    RuntimeError("Resource temporarily unavailable"),
    RuntimeError("std::bad_alloc"),
    OSError(errno.ENOMEM, os.strerror(errno.ENOMEM)),
    BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN)),  # raised by fork
    ImportError("libx.so: failed to map segment from shared object"),
    ImportError("libx.so: cannot allocate memory in static TLS block"),
)


def run(source: Path, limit: int, *words: str) -> subprocess.CompletedProcess[str]:
    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))

    return subprocess.run(
        [sys.executable, "-m", "stereocell.cli", words[0], str(source), *words[1:]],
        capture_output=True,
        text=True,
        check=False,
        timeout=200,
        preexec_fn=limited,
        env={**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[1])},
    )


@pytest.mark.parametrize("limit", [300_000_000, 800_000_000, 1_200_000_000])
@pytest.mark.parametrize("command", ["plan", "build"])
def test_limit_too_small_for_the_libraries_is_refused_at_the_start(
    tmp_path: Path, limit: int, command: str
) -> None:
    source = write_ome_zarr(tmp_path / "v.zarr", [f_phantom()])
    ended = run(source, limit, command, "-o", str(tmp_path / "out"))
    assert ended.returncode == 1, ended.stderr
    assert ended.stderr.count("\n") == 1
    allowed = f"stereocell: memory: {limit / 1e9:.1f} GB of address space are allowed here"
    assert ended.stderr.startswith(allowed)
    assert "`ulimit -v unlimited`" in ended.stderr
    assert not (tmp_path / "out").exists()


def test_without_a_limit_nothing_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes, "address_limit", lambda: float("inf"))
    require_address_space("build")
    monkeypatch.setattr(processes, "address_limit", lambda: 2.0e9)
    with pytest.raises(StereoCellError, match="`build` needs at least"):
        require_address_space("build")


@pytest.mark.parametrize("error", ERRORS, ids=repr)
def test_each_kind_of_memory_error_is_reported_as_such(
    error: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(processes, "address_limit", lambda: 4.0e9)
    words = shortage(error)
    assert words.startswith("out of memory (")
    assert "fewer --workers or a smaller --tile-size" in words
    assert "4.0 GB of address space are allowed here (`ulimit -v`): raise the limit" in words

    def fail(*_: object) -> None:
        raise error

    with pytest.raises(TasksFailedError, match=r"a: out of memory \("):
        Engine(0).run("units", fail, [("a", 0)])
    monkeypatch.setattr(cli, "_run", fail)
    assert cli.main(["settings"]) == 1
    printed = capsys.readouterr().err.splitlines()[-1]
    assert printed == f"stereocell: {words}"


@pytest.mark.parametrize("error", ERRORS[1:6], ids=repr)
def test_memory_error_of_a_reader_is_not_blamed_on_the_file(error: Exception) -> None:
    with (
        pytest.raises(SourceError, match=r"x.zarr: out of memory"),
        one_line("x.zarr", "chunks that are whole"),
    ):
        raise error


def test_other_errors_are_not_called_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    for error in (RuntimeError("no"), OSError(errno.ENOSPC, "No space left"), ImportError("x")):
        assert shortage(error) == ""

    def fail(_: object) -> int:
        raise RuntimeError("a bug")

    monkeypatch.setattr(cli, "_run", fail)
    with pytest.raises(RuntimeError, match="a bug"):
        cli.main(["settings"])

"""Two commands never write into one OUT at once, and a command that has ended blocks nobody."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from stereocell.cli.__main__ import main
from stereocell.model.errors import OutputError
from stereocell.storage.atomic_write import replacing, replacing_folder, write_bytes
from stereocell.storage.claim import LOCK, held, working_for
from stereocell.storage.lock import alone_in
from stereocell.storage.processes import machine
from support.busy_command import start_script
from support.ctrl_c import heeded
from support.server.timeouts import PATIENCE_S

HOLD = """
import sys, time
from pathlib import Path
from stereocell.storage.lock import alone_in
with alone_in(Path(sys.argv[1]), "build"):
    print("held", flush=True)
    time.sleep(60)
"""


def hold(out: Path) -> subprocess.Popen[str]:
    """Start a process that holds OUT, and wait until it does."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(out)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    with process.stdout:
        assert process.stdout.readline() == "held\n"
    return process


def test_a_second_command_is_refused_with_the_name_of_the_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    first = hold(out)
    try:
        for command in (["plan", str(tmp_path / "none.tif"), "-o", str(out)], ["units", str(out)]):
            assert main(command) == 1
            (line,) = capsys.readouterr().err.splitlines()
            assert line.startswith(
                f"stereocell: {out}: `stereocell build` (process {first.pid} on "
            )
            assert line.endswith(" is writing here: wait until it has ended")
        assert [file.name for file in out.iterdir()] == [LOCK]
        assert main(["check", str(out)]) == 1  # a command that only reads is not refused
        assert "is writing here" not in capsys.readouterr().out
    finally:
        first.kill()
        first.wait()


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM])
def test_an_out_is_free_after_its_command_was_killed(tmp_path: Path, end: signal.Signals) -> None:
    first = hold(tmp_path)
    os.kill(first.pid, end)
    first.wait()
    assert (tmp_path / LOCK).exists()
    with alone_in(tmp_path, "stage"):
        assert b'"stage"' in (tmp_path / LOCK).read_bytes()
    assert not (tmp_path / LOCK).exists()


def test_a_lock_that_can_not_be_removed_blocks_nobody_and_hides_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path, missing_ok: bool = False) -> None:
        raise PermissionError(13, "Permission denied", str(path))

    def fail() -> None:
        with monkeypatch.context() as patch, alone_in(tmp_path, "build"):
            patch.setattr(Path, "unlink", refuse)
            raise ValueError("the fault")

    with pytest.raises(ValueError, match="the fault"):
        fail()
    assert (tmp_path / LOCK).exists()
    with alone_in(tmp_path, "stage"):
        pass
    assert not (tmp_path / LOCK).exists()


def test_work_for_a_command_that_has_ended_leaves_nothing(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with alone_in(out, "build"):
        claim = held()
        assert claim is not None
        with working_for(claim):
            write_bytes(out / "in_time", b"x")
        (out / "in_time").unlink()
    refused = r"out: the command that sent this task has ended"
    with working_for(claim), pytest.raises(OutputError, match=refused):
        write_bytes(out / "late", b"x")
    assert not out.exists()
    with alone_in(out, "build"), working_for(claim):  # another command holds OUT
        with pytest.raises(OutputError, match=refused), replacing_folder(out / "late"):
            pass
        assert [path.name for path in out.iterdir()] == [LOCK]


def test_an_interrupted_write_leaves_the_old_file(tmp_path: Path) -> None:
    write_bytes(tmp_path / "a", b"old")
    with alone_in(tmp_path, "build"):
        claim = held()
    assert claim is not None
    (tmp_path / LOCK).write_bytes(claim.content)

    def write() -> None:
        with working_for(claim), replacing(tmp_path / "a") as temporary:
            temporary.write_bytes(b"new")
            (tmp_path / LOCK).write_bytes(b"another's")

    with pytest.raises(OutputError, match="the command that sent this task has ended"):
        write()
    assert (tmp_path / "a").read_bytes() == b"old"
    assert sorted(path.name for path in tmp_path.iterdir()) == [LOCK, "a"]


def test_another_machine_with_the_same_host_name_is_distinguished(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = machine()
    assert machine() == here
    monkeypatch.setattr(Path, "read_text", lambda *_: "started at another time")
    assert (machine() != here) == Path("/proc/sys/kernel/random/boot_id").exists()


def test_only_one_of_many_commands_at_a_time_holds_the_lock_of_out(tmp_path: Path) -> None:
    inside, most, refused = 0, 0, 0
    count = threading.Lock()

    def work() -> None:
        nonlocal inside, most, refused
        for _ in range(50):
            try:
                with alone_in(tmp_path, "units"):
                    with count:
                        inside += 1
                        most = max(most, inside)
                    with count:
                        inside -= 1
            except OutputError:
                with count:
                    refused += 1

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (most, inside) == (1, 0)
    assert refused < 400  # at least one command held OUT


def test_a_command_that_wrote_nothing_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a" / "b" / "out"
    assert main(["build", str(tmp_path / "none.ome.tif"), "-o", str(out)]) == 1
    assert list(tmp_path.iterdir()) == []
    assert len(capsys.readouterr().err.splitlines()) == 1
    kept = tmp_path / "kept"
    kept.mkdir()
    assert main(["units", str(kept)]) == 1
    assert list(kept.iterdir()) == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_write_access_is_reported_in_one_line(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    expected = r"can't be written .* expected a folder of your own"
    with pytest.raises(OutputError, match=expected), alone_in(tmp_path / "out", "build"):
        pass
    tmp_path.chmod(0o700)


def test_a_file_in_place_of_out_is_reported_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="can't be written"), alone_in(tmp_path / "file", "build"):
        pass


HALVES = """
import sys
from contextlib import closing
from pathlib import Path
from stereocell.engine.interrupts import answering_sigterm
from stereocell.engine.run import Engine
from stereocell.storage.lock import alone_in
from support.worker_tasks import write_for_ever

if __name__ == "__main__":
    out = Path(sys.argv[1])
    with answering_sigterm(), alone_in(out, "units"), closing(Engine(2)) as engine:
        engine.run("never", write_for_ever, [(name, out / name) for name in "ab"])
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_command_leaves_finished_files_and_no_partial_ones(
    tmp_path: Path, number: signal.Signals
) -> None:
    out = tmp_path / "out"
    with heeded():
        command = start_script(HALVES, tmp_path, out)
    end = time.monotonic() + PATIENCE_S
    while not all((out / f"{name}.begun").exists() for name in "ab") and time.monotonic() < end:
        time.sleep(0.02)
    halves = {file.name for file in out.glob(".*")}
    command.send_signal(number)
    _, printed = command.communicate(timeout=PATIENCE_S)
    assert len(halves) == 5, printed  # a file and a folder of each worker, and the lock
    assert "KeyboardInterrupt" in printed or "Terminated" in printed
    assert {file.name for file in out.iterdir()} == {
        f"{name}.{ending}" for name in "ab" for ending in ("whole", "begun")
    }


@pytest.mark.parametrize("call", range(4))
def test_ctrl_c_at_any_rename_leaves_the_old_folder_or_the_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: int
) -> None:
    place = tmp_path / "place"
    place.mkdir()
    (place / "old").touch()
    calls = iter(range(100))
    rename = os.replace

    def interrupted(source: Path, target: Path) -> None:
        number = next(calls)
        if number == call and call % 2 == 0:
            raise KeyboardInterrupt
        rename(source, target)
        if number == call // 2 and call % 2 == 1:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", interrupted)
        with suppress(KeyboardInterrupt), replacing_folder(place) as folder:
            (folder / "new").touch()
    assert [file.name for file in place.iterdir()] in (["old"], ["new"])
    assert [file.name for file in tmp_path.iterdir()] == ["place"]

"""A running cluster gives the same bytes as workers of this machine."""

import hashlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import dask
import pytest
from distributed import LocalCluster

from stereocell.cli.__main__ import main
from stereocell.engine.cluster import ClusterError, able, join
from stereocell.engine.run import Engine, TasksFailedError
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.claim import LOCK
from stereocell.storage.lock import alone_in
from support import ctrl_c, phantoms
from support.clusters import running_cluster
from support.exhaustive import examples
from support.object_store import ObjectStore, serving_bucket
from support.server.timeouts import PATIENCE_S
from support.validators import make_assets

GRID = "2x1"
Joined = tuple[str, ObjectStore]  # a scheduler file, and a store that the workers can reach

ROOT = Path(__file__).parents[2]
# Workers import the tests' functions, and what these import.
PATHS = os.pathsep.join([str(ROOT), str(ROOT / "tests"), str(ROOT / "pipeline")])


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Joined]:
    """A scheduler file of workers that run in another folder, and an object store."""
    folder = tmp_path_factory.mktemp("cluster")
    (folder / "objects").mkdir()
    with (
        serving_bucket(folder / "objects") as store,
        running_cluster(folder, examples(2, 1), {**os.environ, "PYTHONPATH": PATHS}) as started,
    ):
        yield started.file, store


@pytest.fixture(scope="module")
def volume(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("volume") / "f.ome.zarr"
    return phantoms.write_ome_zarr(path, [phantoms.f_phantom()])


@pytest.fixture(scope="module")
def alone(volume: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Build in one process, and return the files in the folder."""
    out = tmp_path_factory.mktemp("alone") / "out"
    assert make_assets(volume, out, GRID, "--workers", "0") == 0
    found = results(out)
    assert len(found) > 20
    return found


def results(out: Path) -> dict[str, str]:
    return {
        key: hashlib.sha256((out / key).read_bytes()).hexdigest()
        for key in sorted(file.relative_to(out).as_posix() for file in out.rglob("*"))
        if is_result(key) and (out / key).is_file()
    }


def is_result(key: str) -> bool:
    """Return whether a file must be the same in all builds: it holds no times and no paths."""
    name = key.rpartition("/")[2]
    return key.startswith(("units/", "stage/", "bundle/")) and name not in (
        "seconds.json",
        "plan.key",
    )


@pytest.mark.slow
def test_a_cluster_builds_the_same_bytes_as_one_process(
    cluster: Joined,
    volume: Path,
    alone: dict[str, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(
        tmp_path
    )  # OUT is relative to this folder, and the workers run in another one
    assert make_assets(volume, "out", GRID, "--scheduler", cluster[0]) == 0
    assert results(tmp_path / "out") == alone


@pytest.mark.exhaustive
def test_a_cluster_reads_from_and_writes_to_an_object_store(
    cluster: Joined, volume: Path, alone: dict[str, str]
) -> None:
    scheduler, store = cluster
    print(f"object store: {store.kind}")
    fs = store.files()
    fs.put(str(volume), "bucket/f.ome.zarr", recursive=True)
    flags = ["-o", "s3://bucket/out", "--scheduler", scheduler, "--grid", GRID]
    assert main(["build", "s3://bucket/f.ome.zarr", *flags]) == 0
    keys = [name.removeprefix("bucket/out/") for name in fs.find("bucket/out")]
    assert {
        key: hashlib.sha256(fs.cat_file(f"bucket/out/{key}")).hexdigest()
        for key in keys
        if is_result(key)
    } == alone
    assert not [key for key in keys if "/." in f"/{key}"]


@pytest.mark.slow
def test_a_cluster_that_does_not_see_out_is_refused(cluster: Joined, tmp_path: Path) -> None:
    with pytest.raises(ClusterError, match=r"worker tls://.* on .*: does not see /nowhere/.lock,"):
        join(cluster[0], Path("/nowhere/.lock"))
    join(cluster[0], tmp_path).close()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "ours", "expected"),
    [
        ("version", lambda _: "99", r"on .*: has StereoCell .*, expected 99"),
        ("all_libraries", lambda: {"numpy": "99"}, r"on .*: has numpy .*, expected 99"),
        ("version_of", lambda _: "99", r"on .*: has alktx2 .*, expected 99"),
        (
            "_digest_of_code",
            lambda: "other",
            "runs other code than this command, expected the same",
        ),
    ],
)
def test_workers_that_would_make_other_bytes_are_refused(
    cluster: Joined, monkeypatch: pytest.MonkeyPatch, name: str, ours: object, expected: str
) -> None:
    monkeypatch.setattr(f"stereocell.engine.cluster.{name}", ours)
    with pytest.raises(ClusterError, match=rf"worker tls://.* {expected}"):
        join(cluster[0], None)


@pytest.mark.slow
def test_a_worker_that_joins_later_is_checked_in_the_same_way(
    cluster: Joined, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine = Engine(0, cluster[0], tmp_path)
    try:
        assert engine.run("good", str, [("a", 1), ("b", 2)]) == ["1", "2"]
        monkeypatch.setattr("stereocell.engine.cluster.version", lambda _: "99")
        with pytest.raises(TasksFailedError, match=r"a worker on .*: has StereoCell .*expected 99"):
            engine.run("bad", str, [("a", 1), ("b", 2)])
    finally:
        engine.close()
    with pytest.raises(ClusterError, match=r"does not see /nowhere/.lock, expected OUT in"):
        able(str, Path("/nowhere/.lock"))(1)


def wait_for(file: Path) -> None:
    """Wait for a file, up to the limit of a test."""
    end = time.monotonic() + PATIENCE_S
    while not file.exists() and time.monotonic() < end:
        time.sleep(0.05)


def write_when(task: tuple[Path, Path, Path]) -> None:
    begun, released, file = task
    begun.touch()
    wait_for(released)
    try:
        write_bytes(file, b"late")
    finally:
        released.with_suffix(".over").touch()


@pytest.mark.slow
def test_a_cluster_writes_nothing_for_a_command_that_was_interrupted(
    cluster: Joined, tmp_path: Path
) -> None:
    out, begun, released = tmp_path / "out", tmp_path / "begun", tmp_path / "released"

    def interrupt() -> None:
        wait_for(begun)
        os.kill(os.getpid(), signal.SIGINT)

    def build() -> None:
        with alone_in(out, "build"):
            engine = Engine(0, cluster[0], out / LOCK)
            threading.Thread(target=interrupt).start()
            try:
                engine.run("late", write_when, [("a", (begun, released, out / "tile" / "a"))])
            finally:
                engine.close()

    with ctrl_c.heeded(), pytest.raises(KeyboardInterrupt):
        build()
    assert not out.exists()
    released.touch()
    wait_for(released.with_suffix(".over"))
    assert released.with_suffix(".over").exists()
    assert not out.exists()


@pytest.mark.slow
def test_the_command_does_not_wait_forever_for_a_cluster_whose_workers_are_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stereocell.engine.cluster_tasks._LOOK_S", 0.5)
    monkeypatch.setattr("stereocell.engine.cluster_tasks._LOOKS", 3)
    begun = tmp_path / "begun"

    def kill(worker: "subprocess.Popen[bytes]") -> None:
        while not begun.exists():
            time.sleep(0.05)
        worker.kill()

    with running_cluster(tmp_path, 1, {**os.environ, "PYTHONPATH": PATHS}) as started:
        threading.Thread(target=kill, args=started.workers).start()
        engine = Engine(0, started.file, tmp_path)
        never = tmp_path / "never"
        tasks = [(name, (begun, never, tmp_path / name)) for name in "ab"]
        with pytest.raises(TasksFailedError, match="a, b: its workers are gone and did not come"):
            engine.run("none", write_when, tasks)
        engine.close()


@pytest.mark.slow
def test_a_client_without_the_key_can_run_nothing_on_a_cluster_with_tls(cluster: Joined) -> None:
    address = json.loads(Path(cluster[0]).read_text("utf-8"))["address"]
    assert address.startswith("tls://127.0.0.1:")
    for stranger in (address, address.replace("tls://", "tcp://")):
        # a process of its own, because this one has the certificates
        script = (
            "import os, sys; from distributed import Client; "
            "Client(sys.argv[1], timeout=3).run_on_scheduler(os.getpid)"
        )
        plain = {name: value for name, value in os.environ.items() if "DASK" not in name}
        refused = subprocess.run(
            [sys.executable, "-c", script, stranger],
            env=plain,
            capture_output=True,
            check=False,
            timeout=PATIENCE_S,
        )
        assert refused.returncode == 1


@pytest.mark.slow
def test_a_command_without_certificates_is_refused_with_the_remedy(cluster: Joined) -> None:
    names = ["ca-file", *(f"{role}.cert" for role in ("scheduler", "worker", "client"))]
    nothing = dict.fromkeys((f"distributed.comm.tls.{name}" for name in names), None)
    with (
        dask.config.set({**nothing, "distributed.comm.require-encryption": None}),
        pytest.raises(ClusterError, match=r"this command has none, expected .* DASK_CONFIG"),
    ):
        join(cluster[0], None)


@pytest.mark.slow
def test_a_cluster_without_tls_is_joined_with_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with (
        dask.config.set({"distributed.comm.require-encryption": False}),
        LocalCluster(
            n_workers=1,
            processes=False,
            protocol="tcp",
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
        ) as opened,
    ):
        engine = Engine(0, opened.scheduler_address, tmp_path)
        assert engine.run("good", str, [("a", 1), ("b", 2)]) == ["1", "2"]
        engine.close()
    assert "cluster: found no certificates (TLS), so everybody" in capsys.readouterr().err


@pytest.mark.slow
def test_a_caller_s_own_computations_with_dask_do_not_run_on_the_cluster(
    cluster: Joined, tmp_path: Path
) -> None:
    engine = Engine(0, cluster[0], tmp_path)
    try:
        assert engine.run("good", str, [("a", 1), ("b", 2)]) == ["1", "2"]
        assert dask.config.get("scheduler", None) != "dask.distributed"
    finally:
        engine.close()


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense", "ftp://x"])
def test_an_address_or_file_that_is_not_a_scheduler_s_is_reported_in_one_line(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stereocell.engine.cluster._ANSWER_S", 1)
    with pytest.raises(ClusterError) as raised:
        join(address, None)
    (line,) = str(raised.value).splitlines()
    assert line.startswith(f"--scheduler {address}: ")
    assert "expected the address of a Dask scheduler" in line

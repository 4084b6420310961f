"""A cluster that others have started does the work of `--workers`, to the same bytes."""

import hashlib
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import phantoms
from assets import make_assets
from object_store import ObjectStore, serving
from stereocell.cli import main
from stereocell.cluster import ClusterError, join

GRID = "2x1"
Cluster = tuple[str, ObjectStore]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """The scheduler file of two workers, which stand in another folder, and an object store."""
    folder = tmp_path_factory.mktemp("cluster")
    (folder / "objects").mkdir()
    file = folder / "scheduler.json"
    with serving(folder / "objects") as store, pytest.MonkeyPatch.context() as patch:
        for name, value in store.environment.items():
            patch.setenv(name, value)
        store.files().mkdir("bucket")
        told = ["--scheduler-file", str(file), "--no-dashboard"]
        processes = [_start("scheduler", "--port", "0", *told, cwd=folder)]
        try:
            processes += [_start("worker", "--nthreads", "1", *told, cwd=folder) for _ in range(2)]
            end = time.monotonic() + 60
            while not file.exists() and time.monotonic() < end:
                time.sleep(0.05)
            yield str(file), store
        finally:
            for process in reversed(processes):
                process.kill()
                process.wait()


def _start(*arguments: str, cwd: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "dask", *arguments]
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, cwd=cwd, stdout=quiet, stderr=quiet)


@pytest.fixture(scope="module")
def volume(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("volume") / "f.ome.zarr"
    return phantoms.write_ome_zarr(path, [phantoms.f_phantom()])


@pytest.fixture(scope="module")
def alone(volume: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What one process leaves in a folder."""
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
    """Whether it must be the same whoever built it: no times, and not where the source lies."""
    name = key.rpartition("/")[2]
    return key.startswith(("units/", "stage/", "bundle/")) and name not in (
        "seconds.json",
        "plan.key",
    )


@pytest.mark.slow
def test_a_cluster_builds_the_same_bytes_as_one_process(
    cluster: Cluster,
    volume: Path,
    alone: dict[str, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)  # OUT is told from here; the workers stand elsewhere
    assert make_assets(volume, "out", GRID, "--scheduler", cluster[0]) == 0
    assert results(tmp_path / "out") == alone


@pytest.mark.slow
def test_a_cluster_reads_from_and_writes_to_an_object_store(
    cluster: Cluster, volume: Path, alone: dict[str, str]
) -> None:
    scheduler, store = cluster
    print(f"object store: {store.kind}")
    fs = store.files()
    fs.put(str(volume), "bucket/f.ome.zarr", recursive=True)
    told = ["-o", "s3://bucket/out", "--scheduler", scheduler, "--grid", GRID]
    assert main(["build", "s3://bucket/f.ome.zarr", *told]) == 0
    keys = [name.removeprefix("bucket/out/") for name in fs.find("bucket/out")]
    assert {
        key: hashlib.sha256(fs.cat_file(f"bucket/out/{key}")).hexdigest()
        for key in keys
        if is_result(key)
    } == alone
    assert not [key for key in keys if "/." in f"/{key}"]


@pytest.mark.slow
def test_a_cluster_that_does_not_see_out_is_refused(cluster: Cluster, tmp_path: Path) -> None:
    with pytest.raises(ClusterError, match=r"worker tcp://.* on .*: does not see /nowhere/.lock;"):
        join(cluster[0], Path("/nowhere/.lock"))
    join(cluster[0], tmp_path).close()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "ours", "said"),
    [
        ("version", lambda _: "99", r"on .*: has StereoCell .*, expected 99"),
        ("libraries_of", lambda _: {"numpy": "99"}, r"on .*: has numpy .*, expected 99"),
        ("key_of", lambda *_: "other", "runs other code than this command: expected the same"),
    ],
)
def test_workers_that_would_make_other_bytes_are_refused(
    cluster: Cluster, monkeypatch: pytest.MonkeyPatch, name: str, ours: object, said: str
) -> None:
    monkeypatch.setattr(f"stereocell.cluster.{name}", ours)
    with pytest.raises(ClusterError, match=rf"worker tcp://.* {said}"):
        join(cluster[0], None)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense", "ftp://x"])
def test_what_is_no_scheduler_is_said_in_a_line(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stereocell.cluster._ANSWER_S", 1)
    with pytest.raises(ClusterError) as raised:
        join(address, None)
    (line,) = str(raised.value).splitlines()
    assert line.startswith(f"--scheduler {address}: ")
    assert "expected the address of a Dask scheduler" in line

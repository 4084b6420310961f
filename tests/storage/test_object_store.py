"""An OUT on object storage has the same bytes as a folder; and errors with it."""

import hashlib
import json
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from stereocell.building.tissue import TissueRequest, add_tissue
from stereocell.cli.__main__ import main
from stereocell.engine import object_store_tasks
from stereocell.model.errors import OutputError
from stereocell.model.unit import Unit
from stereocell.steps.unit_files import UnitFolder
from stereocell.storage import workspace
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.object_lock import alone_at
from stereocell.storage.processes import machine, start_of
from support import phantoms
from support.digests import digests_of
from support.faulty_object_store import before
from support.object_store import ObjectStore, serving_bucket
from support.sealed_files import seal
from support.tissue_volumes import blobs
from support.validators import make_assets

GRID = "2x1"
ARGUMENTS = ["--grid", GRID, "--workers", "0"]
PARTS = ("units", "stage", "bundle")


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ObjectStore]:
    with serving_bucket(tmp_path_factory.mktemp("objects")) as store:
        yield store


@pytest.fixture(scope="module")
def volume(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("volume") / "f.ome.tif"
    phantoms.write_ome_tiff(path, phantoms.f_phantom()[None], "CZYX")
    return path


@pytest.fixture(scope="module")
def local(volume: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The SHA-256 of the assets that a build leaves in a folder."""
    out = tmp_path_factory.mktemp("local") / "out"
    assert make_assets(volume, out, GRID, "--workers", "0") == 0
    return {name: sha for name, sha in digests_of(out).items() if name.split("/")[0] in PARTS}


@pytest.fixture(scope="module")
def there(store: ObjectStore, volume: Path) -> str:
    """A build on the store."""
    assert main(["build", str(volume), "-o", "s3://bucket/there", *ARGUMENTS]) == 0
    return "s3://bucket/there"


def kept(store: ObjectStore, prefix: str) -> dict[str, str]:
    """The SHA-256 of each object of a build, except the seconds, which differ."""
    fs = store.files()
    return {
        name.removeprefix(f"{prefix}/"): hashlib.sha256(fs.cat_file(name)).hexdigest()
        for name in fs.find(prefix)
    }


def marks(store: ObjectStore, prefix: str) -> dict[str, str]:
    """The store's own hash of each object of a build, by one request for all."""
    return {
        name.removeprefix(f"{prefix}/"): about["ETag"]
        for name, about in store.files().find(prefix, detail=True).items()
    }


@pytest.mark.parametrize("is_other", [True, False])
def test_an_input_written_during_a_build_is_reported_if_its_bytes_differ(
    store: ObjectStore,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    is_other: bool,
) -> None:
    fs, source = store.files(), f"bucket/{'other' if is_other else 'same'}.ome.zarr"
    body = phantoms.f_phantom()
    for name, voxels in (("a", body), ("b", body[:, ::-1])):
        phantoms.write_ome_zarr(tmp_path / name, [voxels], chunks=(8, 24, 18))
    fs.put(str(tmp_path / "a"), source, recursive=True)
    chunk = "0/c/0/1/0"
    new = (tmp_path / ("b" if is_other else "a") / chunk).read_bytes()
    write, left = UnitFolder.write, [1]

    def write_and_change(form: UnitFolder, place: Path, result: Unit) -> None:
        write(form, place, result)
        if left:
            left.pop()
            fs.pipe_file(f"{source}/{chunk}", new)

    monkeypatch.setattr(UnitFolder, "write", write_and_change)
    out = tmp_path / "out"
    assert main(["plan", f"s3://{source}", "-o", str(out), "--grid", GRID]) == 0
    assert main(["units", str(out), "--workers", "0"]) == int(is_other)
    printed = capsys.readouterr().err
    words = f"changed while it was read: 1 of 10 files, the first is '{chunk}'"
    assert (words in printed) == is_other
    assert bool(list(out.rglob("unit.json"))) != is_other
    if is_other:
        assert "plan into another OUT" in printed
        assert main(["plan", f"s3://{source}", "-o", str(tmp_path / "2"), "--grid", GRID]) == 0
        assert main(["units", str(tmp_path / "2"), "--workers", "0"]) == 0


@pytest.mark.exhaustive
def test_exports_from_object_storage_equal_those_from_a_folder(
    store: ObjectStore, there: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store.files().get("bucket/there", str(tmp_path / "here"), recursive=True)
    for name in ("f.glb", "f.nrrd", "f.usdz"):
        for out, folder in ((there, "a"), (str(tmp_path / "here"), "b")):
            (tmp_path / folder).mkdir(exist_ok=True)
            assert main(["export", out, str(tmp_path / folder / name)]) == 0
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    capsys.readouterr()
    assert main(["export", there, str(tmp_path / "f.usda")]) == 1
    assert "refers to files of OUT by path, expected OUT in a folder" in capsys.readouterr().err


def of_parts(found: dict[str, str]) -> dict[str, str]:
    return {
        key: digest
        for key, digest in found.items()
        if key.split("/")[0] in PARTS and not key.endswith("seconds.json")
    }


@pytest.mark.slow
def test_the_objects_of_a_build_equal_the_files_of_a_local_one(
    store: ObjectStore,
    volume: Path,
    local: dict[str, str],
    there: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    print(f"object store: {store.kind}")
    found, marked = kept(store, "bucket/there"), marks(store, "bucket/there")
    assert of_parts(found) == of_parts(local)
    assert {"plan.json", "phases.json", "report/index.html"} <= found.keys()
    assert not [key for key in found if "/." in f"/{key}"]
    # there is nothing to do, and nothing is done
    assert main(["build", str(volume), "-o", there, *ARGUMENTS]) == 0
    output = capsys.readouterr()
    assert "stage    s3://bucket/there/stage/stage.usda\n" in output.out
    for phase in ("plan", "units", "stage", "bundle", "report"):
        assert f"{phase}: up to date" in output.err
    assert marks(store, "bucket/there") == marked


@pytest.mark.exhaustive
def test_missing_and_unfinished_objects_are_made_again(
    store: ObjectStore, volume: Path, there: str, capsys: pytest.CaptureFixture[str]
) -> None:
    fs = store.files()
    before = of_parts(marks(store, "bucket/there"))
    (unit,) = [
        key for key in before if key.startswith("units/r0_c0/") and key.endswith("voxels.npz")
    ]
    fs.rm(f"bucket/there/{unit}")
    fs.pipe_file("bucket/there/bundle/index.html", b"cut")
    capsys.readouterr()
    assert main(["check", there]) == 1
    assert (
        "FAIL hashes: index.html: its size or hash differs from files.json"
        in capsys.readouterr().out
    )
    assert make_assets(volume, there, GRID, "--workers", "0") == 0
    assert of_parts(marks(store, "bucket/there")) == before
    capsys.readouterr()
    assert main(["check", there, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ok"]
    manifest = fs.cat_file("bucket/there/bundle/manifest.json")
    fs.rm("bucket/there/bundle/manifest.json")
    assert main(["check", there]) == 1
    assert f"FAIL manifest: {there}/bundle/manifest.json is missing" in capsys.readouterr().out
    fs.pipe_file("bucket/there/bundle/manifest.json", manifest)


@pytest.mark.exhaustive
def test_flipped_bits_in_objects_are_reported_and_not_used(
    store: ObjectStore, volume: Path, there: str, capsys: pytest.CaptureFixture[str]
) -> None:
    fs = store.files()
    before = of_parts(marks(store, "bucket/there"))
    (unit,) = [
        key for key in before if key.startswith("units/r0_c0/") and key.endswith("voxels.npz")
    ]
    (atlas,) = [key for key in before if key.startswith("stage/tiles/r0_c0/") and ".exr" in key]
    for key, phase in ((unit, "stage"), (atlas, "bundle")):
        whole = fs.cat_file(f"bucket/there/{key}")
        middle = len(whole) // 2
        flipped = whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]
        fs.pipe_file(f"bucket/there/{key}", flipped)
        capsys.readouterr()
        assert main(["check", there]) == 1
        assert f": {key}: damaged: remove the damaged files and run" in capsys.readouterr().out
        if phase == "stage":
            fs.rm("bucket/there/stage/tiles/r0_c0", recursive=True)
        assert main([phase, there, "--workers", "0"]) == 1
        assert f"{there}/{key}: damaged" in capsys.readouterr().err
        fs.rm(f"bucket/there/{key}")
        assert make_assets(volume, there, GRID, "--workers", "0") == 0
        assert of_parts(marks(store, "bucket/there")) == before


@pytest.mark.slow
def test_a_partly_uploaded_bundle_is_uploaded_again_and_foreign_files_stay(
    store: ObjectStore, volume: Path, there: str, capsys: pytest.CaptureFixture[str]
) -> None:
    fs, out = store.files(), "bucket/there"
    before = of_parts(marks(store, out))
    phases = json.loads(fs.cat_file(f"{out}/phases.json"))
    phases["bundle"]["key"] = ""  # an empty key means that the phase has begun
    fs.pipe_file(f"{out}/phases.json", json.dumps(seal(phases)).encode())
    fs.rm(f"{out}/bundle/manifest.json")  # the manifest is uploaded last
    assert make_assets(volume, there, GRID, "--workers", "0") == 0
    assert of_parts(marks(store, out)) == before
    fs.rm(f"{out}/bundle", recursive=True)
    del phases["bundle"]
    fs.pipe_file(f"{out}/phases.json", json.dumps(seal(phases)).encode())
    fs.pipe_file(f"{out}/bundle/thesis.tex", b"years of work")
    for _ in range(2):
        capsys.readouterr()
        assert main(["bundle", there, "--workers", "0"]) == 1
        assert f"{there}/bundle: found something" in capsys.readouterr().err
        assert fs.cat_file(f"{out}/bundle/thesis.tex") == b"years of work"
    fs.rm(f"{out}/bundle/thesis.tex")
    assert make_assets(volume, there, GRID, "--workers", "0") == 0
    assert of_parts(marks(store, out)) == before


@pytest.mark.exhaustive
def test_a_build_killed_during_uploads_goes_on_to_the_same_bytes(
    store: ObjectStore, volume: Path, local: dict[str, str]
) -> None:
    fs, out = store.files(), "s3://bucket/killed"
    finished: dict[str, object] = {}  # times of upload of the objects of finished units
    for part in ("units/r0_c", "bundle/volumes/"):
        command = [sys.executable, "-m", "stereocell.cli", "build", str(volume), "-o", out]
        build = subprocess.Popen(
            [*command, *ARGUMENTS], stderr=subprocess.DEVNULL, start_new_session=True
        )
        while build.poll() is None and not _objects(fs, f"bucket/killed/{part}"):
            time.sleep(0.05)  # each time the store has to answer
        os.killpg(build.pid, signal.SIGKILL)
        assert build.wait() == -signal.SIGKILL
        for name, found in _objects(fs, "bucket/killed/units/r0_c").items():
            finished.setdefault(name, found)
    assert finished
    assert make_assets(volume, out, GRID, "--workers", "0") == 0
    assert of_parts(kept(store, "bucket/killed")) == of_parts(local)
    now = _objects(fs, "bucket/killed/units/r0_c")
    assert {name: now[name] for name in finished} == finished


def _objects(fs: Any, start: str) -> dict[str, object]:
    """The time of upload of each object whose name begins with a prefix."""
    fs.invalidate_cache()
    return {
        name: found["LastModified"]
        for name, found in fs.find("bucket/killed", detail=True).items()
        if name.startswith(start)
    }


@pytest.mark.slow
def test_the_command_that_writes_is_named_and_a_dead_one_blocks_nobody(
    store: ObjectStore, capsys: pytest.CaptureFixture[str]
) -> None:
    fs, lock = store.files(), "bucket/held/.lock"
    owner = {"process": 7, "host": "elsewhere", "command": "build", "since": "2026-01-01T00:00:00"}
    fs.pipe_file(lock, json.dumps(owner).encode())
    assert main(["units", "s3://bucket/held"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line == (
        "stereocell: s3://bucket/held: `stereocell build` (process 7 on elsewhere, since "
        "2026-01-01T00:00:00) is writing here: wait until it has ended"
    )
    here = {**owner, "process": os.getpid(), "machine": machine()}
    for own in ({}, {"start": start_of(os.getpid())}):
        fs.pipe_file(lock, json.dumps({**here, **own}).encode())
        assert main(["units", "s3://bucket/held"]) == 1
        assert " is writing here: " in capsys.readouterr().err
    dead, ended = (subprocess.Popen([sys.executable, "-c", ""]) for _ in range(2))
    dead.wait()
    os.waitid(os.P_PID, ended.pid, os.WEXITED | os.WNOWAIT)  # its process ID is not free yet
    for gone in (
        {"process": dead.pid},
        {"process": dead.pid, "start": "another"},
        {"process": ended.pid, "start": "another"},
        {"start": "another"},  # its process ID was reused by this process
    ):
        fs.pipe_file(lock, json.dumps({**here, **gone}).encode())
        assert main(["units", "s3://bucket/held"]) == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert line == (
            "stereocell: s3://bucket/held/plan.json is missing: "
            "run `stereocell plan INPUT -o s3://bucket/held` first"
        )
        assert not fs.exists(lock)
    ended.wait()


@pytest.mark.slow
def test_a_lock_is_held_if_it_was_written_but_the_answer_was_lost(store: ObjectStore) -> None:
    with before(store.endpoint) as faults:
        fs = ObjectStore(store.kind, faults.endpoint).files()
        faults.once["PUT", "/.lock"] = "lost"
        with alone_at(fs, "bucket/untold/.lock", "there", "build"):
            assert faults.seen["lost"] == 1
            refused = pytest.raises(OutputError, match=r"`stereocell build` .* is writing here")
            with refused, alone_at(fs, "bucket/untold/.lock", "there", "units"):
                pass
        assert not fs.exists("bucket/untold/.lock")


@pytest.mark.slow
def test_reading_commands_do_not_remove_unfinished_objects(store: ObjectStore) -> None:
    fs = store.files()
    owner = {"process": os.getpid(), "machine": machine(), "start": start_of(os.getpid())}
    made = {
        "bucket/read/.lock": json.dumps(owner).encode(),
        "bucket/read/units/r0_c0/F/.0123456789.deadbeef.partial/voxels.npz": b"half",
        "bucket/read/plan.json": b"{}",
    }
    fs.pipe(made)
    for command in (["check"], ["check", "--deep", "--workers", "0"]):
        assert main([*command, "s3://bucket/read"]) == 1
        assert set(fs.find("bucket/read")) == set(made)


def _put_slowly(file: Path) -> None:
    write_bytes(file, b"x")
    time.sleep(0.2)


def test_each_thread_of_a_worker_reports_its_own_uploads(store: ObjectStore) -> None:
    with (
        workspace.opened("s3://bucket/threads", command="build") as root,
        ThreadPoolExecutor(2) as threads,
    ):
        work, _ = object_store_tasks.carried(_put_slowly)
        output = list(threads.map(work, [root / "a", root / "b"]))
    assert output == [(None, {"a": 1}), (None, {"b": 1})]


def test_work_for_a_command_that_has_ended_uploads_nothing(store: ObjectStore) -> None:
    fs = store.files()
    with workspace.opened("s3://bucket/late", command="build") as root:
        work, _ = object_store_tasks.carried(_put_slowly)
    carried = pickle.dumps(work)  # sent to a cluster's worker
    for lock in (None, b"another's"):
        if lock is not None:
            fs.pipe_file("bucket/late/.lock", lock)
        with pytest.raises(OutputError, match=r"bucket/late: the command that sent .* has ended"):
            pickle.loads(carried)(root / "a")
        assert "bucket/late/a" not in fs.find("bucket/late")
    workspace.forget(root)


def _wait_for(fault: Callable[[], None]) -> None:
    for _ in range(1000):
        fault()
        time.sleep(0.02)


def test_a_lock_that_was_not_renewed_is_taken_over(
    store: ObjectStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stereocell.storage.object_lock._SETTLE_S", 0.0)
    fs, path = store.files(), "bucket/renewed/.lock"
    monkeypatch.setattr("stereocell.storage.object_lock.BEAT_S", 0.05)
    with alone_at(fs, path, "there", "build") as require:
        refused = pytest.raises(OutputError, match="there: `stereocell build`")
        with refused, alone_at(fs, path, "there", "units"):
            pass
        monkeypatch.setattr("stereocell.storage.object_lock.STALE_S", -1e6)
        with alone_at(fs, path, "there", "units"):
            assert json.loads(fs.cat_file(path))["command"] == "units"
            with pytest.raises(OutputError, match=r"there: .* has taken over, .*: start it again"):
                _wait_for(require)
            assert (
                json.loads(fs.cat_file(path))["command"] == "units"
            )  # the lock stays with the second command
        assert not fs.exists(path)
    assert not fs.exists(path)


@pytest.mark.slow
def test_showing_a_build_fetches_only_its_bundle(
    there: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[set[str]] = []

    def serve(out: Path, *_: object, **__: object) -> None:
        seen.append({path.name for path in out.iterdir()})
        assert (out / "bundle" / "manifest.json").is_file()

    monkeypatch.setattr("stereocell.serve.server.serve", serve)
    assert main(["serve", there]) == 0
    # two small records are fetched, too, by which OUT is recognised
    assert seen == [{"bundle", "plan.json", "provenance.json"}]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (
            ["units", "https://me:secret@x.org/out?sig=secret"],
            2,
            "OUT is https://x.org/out, expected a folder or an s3:// address",
        ),
        (["iso", "x.nii", "-o", "s3://a:b@c/x", "--channel", "0", "--tile", "r"], 2, "s3://c/x"),
        (["units", "s3://nowhere/out"], 1, "s3://nowhere/out/.lock: "),
        (
            ["slices", "x.nii", "-o", "s3://bucket/x"],
            2,
            "expected a folder or a file on this machine",
        ),
        (["sample", "mri", "s3://bucket/x"], 2, "expected a folder or a file on this machine"),
        (
            ["iso", "x.nii", "--channel", "0", "--tile", "r0_c0", "-o", "s3://bucket/x.png"],
            2,
            "expected a folder or a file on this machine",
        ),
        (["bundle", "s3://bucket/x", "--stage", "my.usda"], 2, "/x, on object storage, expected"),
        (["units", "nothing://x"], 1, "nothing://x: Protocol not known: nothing"),
    ],
)
def test_an_address_that_can_not_be_written_is_reported_in_one_line(
    store: ObjectStore,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    code: int,
    message: str,
) -> None:
    assert main(arguments) == code
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line
    assert "secret" not in line


@pytest.mark.slow
@pytest.mark.exhaustive
def test_tissue_classes_are_learned_and_built_on_object_storage(
    store: ObjectStore, tmp_path: Path
) -> None:
    voxels, _ = blobs(2)
    source = phantoms.write_ome_tiff(tmp_path / "blobs.ome.tif", voxels[None], "CZYX")
    for out in (str(tmp_path / "out"), "s3://bucket/classes"):
        assert main(["plan", str(source), "-o", out]) == 0
    assert main(["tissue", "s3://bucket/classes", "--classes", "2", "--workers", "0"]) == 0
    found = kept(store, "bucket/classes")
    assert len([key for key in found if key.endswith("unit.json")]) == 3
    add_tissue(tmp_path / "out", TissueRequest(2))
    here = {key: sha for key, sha in digests_of(tmp_path / "out").items() if "tissue/" in key}
    assert here == {key: sha for key, sha in found.items() if key.startswith("tissue/")}
    assert main(["check", "s3://bucket/classes"]) == 0


@pytest.mark.slow
def test_folders_of_killed_commands_are_removed_and_those_in_use_are_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    ours, week_s = machine(), 7 * 24 * 3600
    folders = {
        f"stereocell.{ours}.{dead.pid}.killed": False,
        f"stereocell.{ours}.{os.getpid()}.working": True,
        f"stereocell.0000beef.{dead.pid}.ofanother": True,  # its process is on another machine
        f"stereocell.0000beef.{dead.pid}.longago": False,
        "stereocell.notes": True,
    }
    for name in folders:
        (tmp_path / name / "units").mkdir(parents=True)
    long_ago = time.time() - week_s - 60
    os.utime(tmp_path / f"stereocell.0000beef.{dead.pid}.longago", (long_ago, long_ago))
    workspace._clear_scratch()
    assert {name: (tmp_path / name).exists() for name in folders} == folders

"""The runner moves a step's files between object storage and this machine, not the step itself."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import pytest

from stereocell.engine.run import Engine
from stereocell.engine.run_steps import Kept, run_missing
from stereocell.engine.step import Document, Step
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.workspace import opened
from support.stored_out import emptied, objects_in

VOXELS = bytes(range(256))


@dataclass(frozen=True, slots=True)
class File:
    """A file that counts in a key by its name."""

    path: Path

    def key_content(self) -> str:
        return self.path.name


@dataclass(frozen=True, slots=True)
class Digest(Step[str]):
    """A step that reads a file like any other program."""

    VERSION: ClassVar[int] = 1
    FORM: ClassVar[Document[str]] = Document(
        "units.schema.json#PlanKey",
        lambda digest: {"key": digest},
        lambda content: str(content["key"]),
        "again",
    )

    file: File

    def run(self) -> str:
        return hashlib.sha256(self.file.path.read_bytes()).hexdigest()


def _task(out: Path, *, is_stated: bool = True) -> Kept[str]:
    file = out / "voxels.npy"
    inputs = (file,) if is_stated else ()
    return Kept("voxels", Digest(File(file)), out / "digest.json", inputs)


def test_a_step_on_object_storage_reads_and_writes_local_files() -> None:
    with emptied() as address:
        with opened(address, command="units") as out:
            write_bytes(out / "voxels.npy", VOXELS)
            assert not (out / "voxels.npy").exists()
            assert run_missing(Engine(0), "digests", [_task(out)]) == 1
            assert not (out / "voxels.npy").exists()  # the disk holds only the work in progress
        assert objects_in(address).keys() == {"voxels.npy", "digest.json"}
        with opened(address, command="units") as out:
            assert run_missing(Engine(0), "digests", [_task(out)]) == 0
            assert _task(out).read() == hashlib.sha256(VOXELS).hexdigest()


def test_an_input_that_a_task_does_not_list_is_missing_on_the_worker() -> None:
    with emptied() as address, opened(address, command="units") as out:
        write_bytes(out / "voxels.npy", VOXELS)
        with pytest.raises(Exception, match="No such file"):
            run_missing(Engine(0), "digests", [_task(out, is_stated=False)])

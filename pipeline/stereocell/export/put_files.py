"""Write exported files in a temporary folder beside their place, and move them when complete."""

import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from stereocell.model.errors import OutputError
from stereocell.storage.atomic_write import put_in_place
from stereocell.storage.overwriting import require_free
from stereocell.storage.temporary_names import clear_beside

EXPECTED = "nothing or an earlier export of this build, as it was written"


def make_folder_of(file: Path) -> None:
    """Make the folder of a file. Raises OutputError."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"{file.parent}: can't be made ({error.strerror or error}): choose another folder"
        ) from error


@contextmanager
def folder_beside(file: Path) -> Iterator[Path]:
    """Yield an empty temporary folder beside a file, and remove it afterwards.

    Also removes folders that a killed command left. Raises OutputError if the file can't be
    written, for example without permission or space.
    """
    clear_beside(file)
    folder = file.with_name(f".{file.name}.{secrets.token_hex(4)}.partial")
    try:
        folder.mkdir()
        yield folder
    except OutputError as error:  # in the message, replace the file's temporary name
        raise OutputError(str(error).replace(str(folder / file.name), str(file))) from error
    except OSError as error:
        raise OutputError(f"{file}: can't be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def put_all_in_place(file: Path, beside: Path, is_ours: Callable[[Path], bool]) -> list[Path]:
    """Move all files from the temporary folder to their final places; return their paths."""
    # The file itself is moved last, so that all parts exist as soon as the file exists.
    made = sorted(beside.iterdir(), key=lambda one: one.name == file.name)
    places = [file.parent / one.name for one in made]
    for place in places:
        require_free(place, expected=EXPECTED, is_ours=is_ours(place))
    for one, place in zip(made, places, strict=True):
        put_in_place(one, place, beside / "old")
    return places

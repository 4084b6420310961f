"""One specimen that was handed in, and what has become of it.

FOLDER/ID/upload/           the upload: the only place that may hold a name or a tag of it
FOLDER/ID/understood.json   what is shown of it, with `slices/`
FOLDER/ID/view/             its first view, and views of its build
FOLDER/ID/out/              its build
"""

import re
import secrets
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

from stereocell.inbox.choices import Choices
from stereocell.inbox.reader import Source
from stereocell.inbox.upload import Upload
from stereocell.live.build_process import BuildProcess
from stereocell.live.show_source import Live

Doing = Literal[
    "uploading",
    "unpacking",
    "understanding",
    "understood",
    "failed",
    "queued",
    "building",
    "paused",
    "cancelled",
    "built",
]
DOINGS: tuple[Doing, ...] = get_args(Doing)
ID = re.compile(r"[0-9a-f]{16}")


def new_id() -> str:
    """Return an ID that nobody can guess, and that holds nothing of what is handed in."""
    return secrets.token_hex(8)


@dataclass(eq=False, slots=True)
class Item:
    """An item. Its fields change under the lock of the inbox alone.

    created   s since 1970
    title     as understood; empty: not yet
    line      why it has failed; or empty
    source    the file or folder below `upload`; empty: not arranged yet, or an address
    queued    place among the builds that wait, smaller ones first; 0: it does not wait
    is_local  whether it was handed in at this machine
    round     counts the choices, so that an answer to older ones is not taken for one to newer
    looked    the round of the first view; -1: there is none
    newest    folder of the newest view but for those of the build, as `g1/`; or empty
    writer    the piece that may write: a later one takes over
    writing   held while bytes are written
    reading   held while its upload is read and what is found in it is written
    is_deleted  whether its folder goes: nothing is read any more
    """

    id: str
    folder: Path
    created: float
    is_local: bool
    doing: Doing = "uploading"
    title: str = ""
    line: str = ""
    choices: Choices = field(default_factory=Choices)
    keep_upload: bool = False
    source: str = ""
    queued: int = 0
    upload: Upload | None = None
    live: Live | None = None
    build: BuildProcess | None = None
    round: int = 0
    looked: int = -1
    newest: str = ""
    writer: object = None
    writing: threading.Lock = field(default_factory=threading.Lock)
    reading: threading.Lock = field(default_factory=threading.Lock)
    is_deleted: bool = False

    @property
    def upload_folder(self) -> Path:
        """The folder of the upload."""
        return self.folder / "upload"

    @property
    def view_folder(self) -> Path:
        """The folder of the views before the build is whole."""
        return self.folder / "view"

    @property
    def out(self) -> Path:
        """The folder of the build."""
        return self.folder / "out"

    @property
    def understood_file(self) -> Path:
        """The JSON file of the facts that the reader found."""
        return self.folder / "understood.json"

    @property
    def address(self) -> str:
        """The address that was handed in; empty: files were."""
        return "" if self.upload is None else self.upload.announced.address

    @property
    def has_view(self) -> bool:
        """Whether there is a view of it, of older choices perhaps."""
        return self.live is not None or self.doing == "built"

    @property
    def page(self) -> str:
        """The address of its page, relative to the inbox; empty: it has no view of its choices."""
        is_newest = self.doing == "built" or self.looked == self.round
        return f"items/{self.id}/view/" if self.has_view and is_newest else ""

    def place(self) -> Source:
        """Return the source as a reader takes it; its upload must be there."""
        if not self.address:
            return Source(str(self.upload_folder / self.source))
        return Source(self.address)

    def to_record(self) -> dict[str, Any]:
        """Return what of it survives a restart. Nothing of it comes from the upload."""
        return {
            "id": self.id,
            "created": self.created,
            "is_local": self.is_local,
            "doing": self.doing,
            "title": self.title,
            "line": self.line,
            "choices": self.choices.to_json(),
            "keep_upload": self.keep_upload,
            "source": self.source,
            "queued": self.queued,
        }

    @classmethod
    def from_record(cls, record: Mapping[str, Any], folder: Path) -> "Item":
        """Return the item that `to_record` was made of. Its upload is opened."""
        choices = Choices.from_json(record["choices"])
        item = cls(**{**record, "choices": choices}, folder=folder / record["id"])
        item.upload = Upload.open(item.upload_folder)
        return item

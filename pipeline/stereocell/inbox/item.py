"""One specimen that was uploaded, and the state of its reading and its build.

FOLDER/ID/upload/           the upload: the only place that may hold names and tags of the files
FOLDER/ID/understood.json   facts that the page shows, with pictures in `slices/`
FOLDER/ID/view/             the first view, and views of the build
FOLDER/ID/out/              the build
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
    """Return an ID that nobody can guess, and that reveals nothing about the upload."""
    return secrets.token_hex(8)


@dataclass(eq=False, slots=True)
class Item:
    """An uploaded specimen. Its fields change only under the lock of the inbox.

    created       s since 1970
    title         title that the reader gave; empty until the upload was read
    line          reason of a failure, or empty
    source        file or folder to open, below `upload`; empty for an address and before arranging
    queued        place among the builds that wait, smaller ones first; 0 if no build waits
    is_local      whether a person at this machine uploaded it
    round         number of changes of the choices; results of a smaller number are outdated
    viewed_round  the round of the first view; -1 if there is no view
    newest        folder of the newest view, such as `g1/`, without those that the present build
                  writes; or empty
    writer        the piece of the upload that may write; a later piece takes over
    writing       lock that is held while bytes are written
    reading       lock that is held while the upload is read and the results are written
    is_deleted    whether the folder is being deleted, so that no reading may begin
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
    viewed_round: int = -1
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
        """The folder of the views that are shown until the build is complete."""
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
        """The address that a person pasted; empty if they uploaded files."""
        return "" if self.upload is None else self.upload.announced.address

    @property
    def has_view(self) -> bool:
        """Whether the item has a view, possibly of older choices."""
        return self.live is not None or self.doing == "built"

    @property
    def page(self) -> str:
        """The address of the view's page, relative to the inbox; empty without a current view."""
        is_newest = self.doing == "built" or self.viewed_round == self.round
        return f"items/{self.id}/view/" if self.has_view and is_newest else ""

    def place(self) -> Source:
        """Return the source for a reader. The upload must exist."""
        if not self.address:
            return Source(str(self.upload_folder / self.source))
        return Source(self.address)

    def to_record(self) -> dict[str, Any]:
        """Return the fields that survive a restart. No field is copied from the upload."""
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
        """Return the item from which `to_record` made a record, with its upload opened."""
        choices = Choices.from_json(record["choices"])
        item = cls(**{**record, "choices": choices}, folder=folder / record["id"])
        item.upload = Upload.open(item.upload_folder)
        return item

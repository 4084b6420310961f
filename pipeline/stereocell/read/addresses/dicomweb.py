"""DICOMweb: fetch a series of a PACS or an archive into files in a folder.

QIDO-RS finds the series and its number of instances. WADO-RS sends these in one multipart answer
(DICOM PS3.18, chapter 10). An address identifies a patient's examination, so no message, note or
name contains it.
"""

import os
import re
import string
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.addresses import fetched_folder
from stereocell.read.addresses.multipart import boundary_of, split_parts
from stereocell.read.addresses.resolved import NotThereError, Resolved, other_form, wrong_answer
from stereocell.read.addresses.web_client import WebClient
from stereocell.storage.public_hosts import is_public, numbers_of, split_address

TOKEN = "STEREOCELL_DICOMWEB_TOKEN"  # environment variable with the bearer token
FORMS = ("https://HOST/.../studies/UID/series/UID", "https://HOST/.../studies/UID")
SERIES_BYTES = 16 << 30  # bytes; a larger series is refused
MAX_INSTANCES = 100_000  # instances; a series with more is refused
UID = r"[0-9]+(?:\.[0-9]+)+"
_LONGEST_UID = 64  # characters; a longer UID is refused
_ADDRESS = re.compile(
    rf"(?P<root>https?://[^?#]+?)/studies/(?P<study>{UID})(?:/series/(?P<series>{UID}))?/?"
)
_OTHER_FORM = re.compile(
    rf"https?://[^?#]+/studies/{UID}(/series/{UID})?(/instances.*|/metadata|/rendered|/thumbnail"
    rf"|/series|/bulkdata.*|/?[?#].*)"
    rf"|https?://[^#]+/(series|studies|instances)\?.*(StudyInstanceUID|0020000D)=.*"
    rf"|https?://.*[?&]StudyInstanceUIDs?=.*"
)
_MODALITY = re.compile(r"[A-Z0-9_]{1,16}")
# modalities whose objects are not images, or not acquired ones
_NO_IMAGES = frozenset(
    (
        *("AU", "DOC", "ECG", "EEG", "FID", "HD", "KO", "PLAN", "PR", "REG", "RTDOSE", "RTPLAN"),
        *("RTRECORD", "RTSTRUCT", "RWV", "SEG", "SR"),
    )
)
_PREAMBLE, _MARK = 128, b"DICM"


def is_other_form(address: str) -> bool:
    """Return whether an address has another form of DICOMweb, or belongs to a viewer of it."""
    return _ADDRESS.fullmatch(address) is None and _OTHER_FORM.fullmatch(address) is not None


def resolve(address: str) -> Resolved | None:
    """Fetch the series of a DICOMweb address; None: it is not a DICOMweb address."""
    if is_other_form(address):
        raise other_form(f"https://{urlsplit(address).hostname}", "DICOMweb", FORMS)
    match = _ADDRESS.fullmatch(address)
    if match is None:
        return None
    study, uid = match["study"], match["series"]
    if len(study) > _LONGEST_UID or len(uid or "") > _LONGEST_UID:
        raise UsageError(f"DICOMweb: found a UID of more than {_LONGEST_UID} digits and dots")
    root = match["root"]
    shown = f"DICOMweb at {split_address(root).hostname}"
    login = f"expected a bearer token of this server as {TOKEN}"
    token = _token_for(root, shown)
    if token:
        login = f"expected another token as {TOKEN}"
    client = WebClient([root], shown=shown, token=token, login=login)
    found = _find_series(client, f"{root}/studies/{quote(study)}/series", uid)
    chosen = max(found, key=lambda one: one.instances)
    folder = fetched_folder.new_folder("dicom")
    try:
        count = _fetch(client, f"{root}/studies/{study}/series/{chosen.uid}", folder)
    except BaseException:
        fetched_folder.remove(folder)
        raise
    notes = [
        f"DICOMweb: one series ({chosen.modality}, {count} instances) is read from a temporary "
        "folder, which is removed at the end"
    ]
    if count != chosen.instances and chosen.instances:
        notes.append(
            f"DICOMweb: the server counts {chosen.instances} instances in the series and has sent "
            f"{count}"
        )
    if len(found) > 1:
        others = ", ".join(f"{one.modality} {one.instances}" for one in found)
        notes.append(
            f"DICOMweb: the study has {len(found)} series of images ({others} instances); the "
            "largest is read. An address with /series/UID names another one"
        )
    return Resolved(str(folder), tuple(notes))


@dataclass(frozen=True, slots=True)
class _Series:
    uid: str
    modality: str
    instances: int


def _find_series(client: WebClient, address: str, uid: str | None) -> list[_Series]:
    """Return the image series of a study, or the series with a UID, by QIDO-RS."""
    if uid is not None:
        address += f"?SeriesInstanceUID={uid}"
    try:
        rows = client.fetch_json(address, accept="application/dicom+json")
    except NotThereError:
        rows = None
    if rows is None:
        rows = []
    if not isinstance(rows, list):
        raise wrong_answer(client.shown, type(rows).__name__, "a list of series")
    found = [_series_of(row, client.shown) for row in rows]
    if uid is not None:
        found = [one for one in found if one.uid == uid]
    else:
        found = [one for one in found if one.modality not in _NO_IMAGES]
    if not found:
        wanted = "the series" if uid else "a series of images in the study"
        raise SourceError(f"{client.shown}: the server does not have {wanted} of this address")
    return found


def _series_of(row: Any, shown: str) -> _Series:
    uid = _first(row, "0020000E")
    if not isinstance(uid, str) or not re.fullmatch(UID, uid) or len(uid) > _LONGEST_UID:
        raise wrong_answer(shown, "a series without a UID (0020000E)", "series by QIDO-RS")
    modality, count = _first(row, "00080060"), _first(row, "00201209")
    if not isinstance(modality, str) or not _MODALITY.fullmatch(modality):
        modality = "modality not stated"
    if isinstance(count, str) and count.isdecimal() and len(count) < 10:
        count = int(count)
    is_count = isinstance(count, int) and not isinstance(count, bool) and count >= 0
    return _Series(uid, modality, count if is_count else 0)


def _first(row: Any, tag: str) -> Any:
    """Return the first value of an element in the DICOM JSON model; None: there is none."""
    element = row.get(tag) if isinstance(row, dict) else None
    values = element.get("Value") if isinstance(element, dict) else None
    return values[0] if isinstance(values, list) and values else None


def _fetch(client: WebClient, address: str, folder: Path) -> int:
    """Write the instances of a series to files named by numbers, and return their number."""
    accept = 'multipart/related; type="application/dicom"; transfer-syntax=*'
    with client.opened(address, accept) as response:
        boundary = boundary_of(response.headers.get("Content-Type", ""), client.shown)
        parts = split_parts(client.blocks(response), boundary, client.shown)
        count = size = 0
        for first in parts:
            count += 1
            if count > MAX_INSTANCES:
                raise wrong_answer(
                    client.shown, "more instances", f"at most {MAX_INSTANCES:,} instances"
                )
            path = folder / f"{count:06d}.dcm"
            size += _write(path, first, parts, client.shown, limit=SERIES_BYTES - size)
            require_dicom(path, f"{client.shown}: instance {count}")
    if not count:
        raise wrong_answer(client.shown, "no instance", "the instances of the series")
    return count


def _write(
    path: Path, first: bytes | None, rest: Iterator[bytes | None], shown: str, *, limit: int
) -> int:
    """Write one part of an answer, whose pieces end with None, to a file; return its bytes."""
    size, piece = 0, first
    with open(path, "xb") as file:
        while piece is not None:
            size += len(piece)
            if size > limit:
                raise wrong_answer(
                    shown, "a larger series", f"at most {SERIES_BYTES >> 30} GiB in a series"
                )
            file.write(piece)
            piece = next(rest, None)
    return size


def require_dicom(path: Path, shown: str) -> None:
    """Raise SourceError if a file that a server sent is not a DICOM file."""
    with open(path, "rb") as file:
        head = file.read(_PREAMBLE + len(_MARK))
    if head[_PREAMBLE:] != _MARK:
        is_page = head.lstrip()[:1] == b"<"
        found = "a web page" if is_page else f"{len(head)} bytes or more of another kind"
        raise wrong_answer(shown, found, "a DICOM file")


def _token_for(root: str, shown: str) -> str:
    """Return the bearer token from the environment; empty: there is none.

    Raises UsageError where it can't be sent, or where others could read it on its way.
    """
    token = os.environ.get(TOKEN, "").strip()
    if set(token) - set(string.ascii_letters + string.digits + string.punctuation):
        raise UsageError(f"{TOKEN}: found spaces or other characters, expected a bearer token")
    if not token or root.startswith("https://"):
        return token
    if any(not _is_loopback(number) for number in numbers_of(root)):
        raise UsageError(
            f"{shown}: {TOKEN} is set, but http:// would show it to others on the way, expected "
            "https://, or no token"
        )
    return token


def _is_loopback(number: str) -> bool:
    return not is_public(number) and (number.startswith("127.") or number == "::1")

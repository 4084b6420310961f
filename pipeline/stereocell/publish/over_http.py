"""What a host answers for the files of a bundle, held against their hashes."""

import hashlib
import urllib.error
import urllib.request
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from http.client import HTTPException
from pathlib import PurePosixPath
from typing import Any
from urllib.parse import quote

from stereocell.formats.media_types import media_type

INDEX = "index.html"
_AT_ONCE = 8
_WAIT_S = 30.0
_BLOCK = 1 << 20
# browsers refuse these, or take them for text, where the host says another type
_STRICT = (".html", ".js", ".wasm", ".webmanifest", ".json")


def fetch_faults(
    address: str, entries: Mapping[str, Mapping[str, Any]], report: Callable[[str], None]
) -> dict[str, str]:
    """Return what is wrong with each file that a host sends, by path: none where it is empty.

    address  with a slash at its end
    entries  path -> bytes and sha256
    """
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        found = pool.map(lambda path: _fault(address, path, entries[path]), entries)
        faults = {path: fault for path, fault in zip(entries, found, strict=True) if fault}
    report(f"{len(entries) - len(faults)} of {len(entries)} files are right at {address}")
    return faults


def find_page(address: str, entries: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the address of the page: of the folder, or of its index.html where the host, as S3,
    answers with no page for a folder.
    """
    index = entries.get(INDEX)
    return address if index is None or _fault(address, "", index) is None else address + INDEX


def _fault(address: str, path: str, entry: Mapping[str, Any]) -> str | None:
    # of what some host sends packed all the same, the hash would be another's
    request = urllib.request.Request(
        address + quote(path), headers={"Accept-Encoding": "identity", "Cache-Control": "no-cache"}
    )
    digest, count = hashlib.sha256(), 0
    try:
        with urllib.request.urlopen(request, timeout=_WAIT_S) as answer:
            while block := answer.read(_BLOCK):
                digest.update(block)
                count += len(block)
            found_type = answer.headers.get_content_type()
    except urllib.error.HTTPError as error:
        return f"answered with {error.code} {error.reason}"
    except (OSError, HTTPException, ValueError) as error:
        reason = getattr(error, "reason", error)
        return f"no answer ({reason})"
    if count != entry["bytes"]:
        return f"found {count} bytes"
    if digest.hexdigest() != entry["sha256"]:
        return "found other bytes"
    expected = media_type(PurePosixPath(path)).partition(";")[0]
    is_packed = path.endswith((".gz", ".br"))
    if (
        path.endswith(_STRICT)
        and not is_packed
        and found_type not in (expected, "application/javascript")
    ):
        return f"found the type {found_type}, which browsers don't take for {expected}"
    return None

"""Fetch a published bundle's files from its host, and compare them with their hashes."""

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
# Browsers refuse these files, or show them as text, if the host sends another type.
_STRICT = (".html", ".js", ".wasm", ".webmanifest", ".json")


def fetch_faults(
    address: str, entries: Mapping[str, Mapping[str, Any]], report: Callable[[str], None]
) -> dict[str, str]:
    """Return the fault of each file that a host sends wrongly, by path; empty if all are right.

    address  address of the folder, with a slash at its end
    entries  path -> entry with size (`bytes`) and hash (`sha256`)
    """
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        found = pool.map(lambda path: _fault(address, path, entries[path]), entries)
        faults = {path: fault for path, fault in zip(entries, found, strict=True) if fault}
    report(f"{len(entries) - len(faults)} of {len(entries)} files are correct at {address}")
    return faults


def find_page(address: str, entries: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the address at which a host serves the published page.

    This is the folder's address, or its index.html for a host that sends no page for a folder, such
    as S3.
    """
    index = entries.get(INDEX)
    return address if index is None or _fault(address, "", index) is None else address + INDEX


def _fault(address: str, path: str, entry: Mapping[str, Any]) -> str | None:
    # The hash is that of the uncompressed file, so the host must not compress its answer.
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
        return f"the host answered {error.code} {error.reason}"
    except (OSError, HTTPException, ValueError) as error:
        reason = getattr(error, "reason", error)
        return f"the host did not answer ({reason})"
    if count != entry["bytes"]:
        return f"found {count} bytes"
    if digest.hexdigest() != entry["sha256"]:
        return "found different bytes"
    expected = media_type(PurePosixPath(path)).partition(";")[0]
    is_packed = path.endswith((".gz", ".br"))
    if (
        path.endswith(_STRICT)
        and not is_packed
        and found_type not in (expected, "application/javascript")
    ):
        return f"found the type {found_type}, which browsers don't accept as {expected}"
    return None

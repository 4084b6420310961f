"""DANDI: find Zarr and NIfTI assets of the archive.

The archive's API returns the metadata of an asset: `contentUrl` is the address of its data in the
archive's bucket, `encodingFormat` the type, `path` the name in its dandiset.
"""

import re
from typing import Any
from urllib.parse import parse_qs, quote, urlsplit

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.addresses import fetched_folder
from stereocell.read.addresses.resolved import NotThereError, Resolved, other_form, wrong_answer
from stereocell.read.addresses.web_client import WebClient

API = "https://api.dandiarchive.org/api"
# the archive's public bucket; an answer that leads elsewhere is refused
DATA = (
    "https://dandiarchive.s3.amazonaws.com",
    "https://dandiarchive.s3.us-east-2.amazonaws.com",
)
FORMS = (
    "https://api.dandiarchive.org/api/assets/UUID/",
    "https://dandiarchive.org/dandiset/NUMBER/VERSION/files?location=PATH",
)
FILE_BYTES = 16 << 30  # bytes; a larger NIfTI file is refused
_UUID = r"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}"
_OBJECT = re.compile(r"/(zarr|blobs)(/[\w-]+)+/?")
_NUMBER, _VERSION = r"\d{6}", r"draft|\d+\.\d+\.\d+"
_ASSET = re.compile(
    rf"/api/(?:dandisets/{_NUMBER}/versions/(?:{_VERSION})/)?assets/({_UUID})(?:/download)?/?"
)
_DANDISET = re.compile(rf"/?(?:dandiset/)({_NUMBER})(?:/({_VERSION}))?(?:/files)?/?")
_HOSTS = (
    "dandiarchive.org",
    "www.dandiarchive.org",
    "gui.dandiarchive.org",
    "api.dandiarchive.org",
)
_NIFTI = (".nii", ".nii.gz")
_READ = (".zarr", *_NIFTI)
_LISTED = 5  # assets that a message names at most


def resolve(address: str) -> Resolved | None:
    """Return the data of an asset; None: the address is not one of the archive's."""
    parts = urlsplit(address)
    if parts.hostname not in _HOSTS or parts.scheme not in ("http", "https"):
        return None
    client = WebClient([API, *DATA], shown="DANDI")
    if match := _ASSET.fullmatch(parts.path):
        return _asset(client, match[1])
    inner = urlsplit(parts.fragment) if parts.fragment.startswith("/dandiset/") else parts
    match = _DANDISET.fullmatch(inner.path)
    if match is None:
        raise other_form(address[:200], "DANDI", FORMS)
    place = parse_qs(inner.query).get("location", [""])[0].strip("/")
    return _asset(client, _find_asset(client, match[1], match[2] or "", place))


def _find_asset(client: WebClient, number: str, version: str, place: str) -> str:
    """Return the UUID of the only readable asset at a path in a dandiset."""
    version = version or _newest(client, number)
    query = f"path={quote(place, safe='')}&page_size=1000"
    address = f"{API}/dandisets/{number}/versions/{version}/assets/?{query}"
    answer = client.fetch_json(address)
    rows = answer.get("results") if isinstance(answer, dict) else None
    if not isinstance(rows, list):
        raise wrong_answer(client.shown, "no results", 'JSON with "results"')
    pairs = [
        (str(row.get("path")), str(row.get("asset_id"))) for row in rows if isinstance(row, dict)
    ]
    # The archive also lists paths that only begin with these letters, such as `sub-10` for `sub-1`.
    own = [(p, key) for p, key in pairs if not place or p == place or p.startswith(f"{place}/")]
    found = [(path, key) for path, key in own if path.lower().endswith(_READ)]
    found = [(path, key) for path, key in found if path == place] or found
    is_more = bool(answer.get("next")) and [path for path, _ in found] != [place]
    count = f"{len(own)} assets{' or more' if is_more else ''}"
    if not found:
        raise SourceError(
            f"DANDI {number}: found {count} at {place or 'the top'!r:.120}, but no Zarr or NIfTI "
            "among them, expected one: name its folder with location="
        )
    if len(found) > 1 or is_more:
        names = ", ".join(repr(path)[:120] for path, _ in found[:_LISTED])
        more = ", ..." if len(found) > _LISTED else ""
        raise UsageError(
            f"DANDI {number}: found {count}, {len(found)} of them Zarr or NIfTI ({names}{more}), "
            "expected one: give its full path with location=, or use "
            "https://api.dandiarchive.org/api/assets/UUID/"
        )
    key = found[0][1]
    if not re.fullmatch(_UUID, key):
        raise wrong_answer(client.shown, f"asset_id {key!r:.60}", "a UUID")
    return key


def _newest(client: WebClient, number: str) -> str:
    """Return the newest published version of a dandiset, or else its draft."""
    try:
        answer = client.fetch_json(f"{API}/dandisets/{number}/")
    except NotThereError:
        raise SourceError(f"DANDI {number}: not found, expected the number of a dandiset") from None
    found = answer.get("most_recent_published_version") if isinstance(answer, dict) else None
    version = str(found.get("version")) if isinstance(found, dict) else "draft"
    if not re.fullmatch(_VERSION, version):
        raise wrong_answer(client.shown, f"version {version!r:.60}", "one such as 0.210914.1900")
    return version


def _asset(client: WebClient, uuid: str) -> Resolved:
    try:
        asset = client.fetch_json(f"{API}/assets/{uuid}/")
    except NotThereError:
        raise SourceError(f"DANDI asset {uuid}: not found, expected the UUID of an asset") from None
    if not isinstance(asset, dict):
        raise wrong_answer(client.shown, "no metadata", "the metadata of an asset")
    path, address = str(asset.get("path", "")).lower(), _address_in(asset, uuid)
    if asset.get("encodingFormat") == "application/x-zarr" or path.endswith(".zarr"):
        if not path.endswith(".zarr") or path.endswith(".nwb.zarr"):
            raise SourceError(f"DANDI asset {uuid}: found NWB in Zarr, expected OME-Zarr or NIfTI")
        return Resolved(address, (f"DANDI asset {uuid} is read from {address}",))
    ending = next((one for one in reversed(_NIFTI) if path.endswith(one)), "")
    if not ending:
        kind = str(asset.get("encodingFormat"))
        raise SourceError(
            f"DANDI asset {uuid}: found {kind!r:.80}, expected OME-Zarr or NIfTI: download other "
            "kinds yourself"
        )
    folder = fetched_folder.new_folder("dandi")
    file = folder / f"asset{ending}"  # the name in the dandiset may identify a subject
    try:
        client.save(address, file, limit=FILE_BYTES)
    except BaseException:
        fetched_folder.remove(folder)
        raise
    note = (
        f"DANDI asset {uuid} (NIfTI) of {address} is read from a temporary folder, which is "
        "removed at the end"
    )
    return Resolved(str(file), (note,))


def _address_in(asset: dict[str, Any], uuid: str) -> str:
    """Return the address of the data in the archive's bucket. Raises SourceError."""
    found = asset.get("contentUrl")
    addresses = [one for one in found if isinstance(one, str)] if isinstance(found, list) else []
    address = next(filter(_is_data, addresses), "")
    if not address:
        words = addresses[-1] if addresses else "none"
        raise wrong_answer(
            f"DANDI asset {uuid}",
            f"contentUrl {words!r:.120}",
            "an address in the archive's public bucket (an embargoed dandiset has none)",
        )
    return address


def _is_data(address: str) -> bool:
    base = next((base for base in DATA if address.startswith(f"{base}/")), None)
    return base is not None and _OBJECT.fullmatch(address.removeprefix(base)) is not None

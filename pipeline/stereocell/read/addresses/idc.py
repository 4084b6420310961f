"""Imaging Data Commons: fetch a series from its public buckets into files in a folder.

A series lies at `BUCKET/CRDC_SERIES_UUID/INSTANCE.dcm`. Links to the viewer contain DICOM UIDs; the
index of the Commons (its API, version 3) returns bucket and UUID for them.
"""

import re
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import parse_qs, quote, urlencode, urlsplit
from xml.etree import ElementTree

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.addresses import fetched_folder
from stereocell.read.addresses.dicomweb import MAX_INSTANCES, SERIES_BYTES, UID, require_dicom
from stereocell.read.addresses.resolved import Resolved, other_form, wrong_answer
from stereocell.read.addresses.web_client import WebClient

API = "https://api.imaging.datacommons.cancer.gov/v3"
BUCKET = "https://{bucket}.s3.amazonaws.com"  # address of a bucket without credentials
BUCKETS = ("idc-open-data", "idc-open-data-two", "idc-open-data-cr")
FORMS = (
    "s3://idc-open-data/UUID/",
    "https://viewer.imaging.datacommons.cancer.gov/v3/viewer/?StudyInstanceUIDs=UID"
    "&SeriesInstanceUIDs=UID",
)
_UUID = r"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}"
_IN_BUCKET = re.compile(
    rf"(?:s3://|https://)(?P<bucket>{'|'.join(BUCKETS)})(?:\.s3[\w.-]*\.amazonaws\.com)?"
    rf"/(?P<uuid>{_UUID})(?:/\*?)?"
)
_KEY = re.compile(rf"(?P<uuid>{_UUID})/[\w-]+\.dcm")
_HOST = "imaging.datacommons.cancer.gov"
_AT_ONCE = 8  # files that are fetched at the same time
_PAGES = 1 + MAX_INSTANCES // 1000  # pages of a listing with 1000 objects each


def resolve(address: str) -> Resolved | None:
    """Fetch a series of the Commons; None: it is not one of the Commons' addresses."""
    if match := _IN_BUCKET.fullmatch(address):
        return _fetch(match["bucket"], match["uuid"])
    parts = urlsplit(address)
    host = parts.hostname or ""
    is_bucket = parts.scheme == "s3" and host in BUCKETS
    if host == _HOST or (host.endswith(f".{_HOST}") and not host.startswith(("proxy.", "api."))):
        if not (uids := _uids_in(address)):
            raise other_form(f"https://{host}", "Imaging Data Commons", FORMS)
        return _fetch(*_look_up(*uids))
    if is_bucket or host.partition(".s3")[0] in BUCKETS:
        raise other_form(address[:200], "Imaging Data Commons", FORMS)
    return None


def _uids_in(address: str) -> tuple[str, str] | None:
    """Return the study and the series (or "") that a link to the viewer names."""
    parts = urlsplit(address)
    query = {key.lower(): values[0] for key, values in parse_qs(parts.query).items()}
    path = re.fullmatch(rf"/(?:viewer|slim/studies)/({UID})(?:/series/({UID}))?/?", parts.path)
    study = path[1] if path else query.get("studyinstanceuids", query.get("studyinstanceuid", ""))
    names = ("seriesinstanceuids", "seriesinstanceuid", "initialseriesinstanceuid")
    series = (path[2] if path else None) or next((query[n] for n in names if n in query), "")
    if "," in series:
        raise UsageError(
            "Imaging Data Commons: found a link to several series, expected one: keep only one "
            "UID in SeriesInstanceUIDs="
        )
    if not re.fullmatch(UID, study) or (series and not re.fullmatch(UID, series)):
        return None
    return study, series


def _look_up(study: str, series: str) -> tuple[str, str]:
    """Return bucket and UUID of a series, from the Commons' index."""
    client = WebClient([API], shown="Imaging Data Commons")
    by = f"SeriesInstanceUID = '{series}'" if series else f"StudyInstanceUID = '{study}'"
    query = f"SELECT aws_bucket, crdc_series_uuid FROM index WHERE {by}"
    answer = client.fetch_json(f"{API}/sql", post={"sql": query})
    rows = answer.get("rows") if isinstance(answer, dict) else None
    if not isinstance(rows, list):
        raise wrong_answer(client.shown, "no rows", 'JSON with "rows"')
    if not rows:
        raise SourceError(
            "Imaging Data Commons: the index does not have the series of this link, expected one "
            "of the newest version"
        )
    if len(rows) > 1:
        raise UsageError(
            f"Imaging Data Commons: found a link to a study of {len(rows)} series, expected one "
            "series: add &SeriesInstanceUIDs=UID"
        )
    row = rows[0] if isinstance(rows[0], dict) else {}
    bucket, uuid = str(row.get("aws_bucket")), str(row.get("crdc_series_uuid"))
    if bucket not in BUCKETS or not re.fullmatch(_UUID, uuid):
        raise wrong_answer(client.shown, f"{bucket:.40}/{uuid:.40}", "a public bucket and a UUID")
    return bucket, uuid


def _fetch(bucket: str, uuid: str) -> Resolved:
    place = BUCKET.format(bucket=bucket)
    client = WebClient([place], shown=f"s3://{bucket}/{uuid}/")
    sizes = _listed(client, place, uuid)
    folder = fetched_folder.new_folder(f"idc-{uuid[:8]}")

    def save(item: tuple[int, str]) -> None:
        number, key = item
        path = folder / f"{number:06d}.dcm"
        client.save(f"{place}/{quote(key)}", path, limit=sizes[key])
        require_dicom(path, f"{client.shown}: file {number}")

    try:
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            list(pool.map(save, enumerate(sorted(sizes), 1)))
    except BaseException:
        fetched_folder.remove(folder)
        raise
    note = (
        f"Imaging Data Commons: series {uuid} ({len(sizes)} files) of s3://{bucket} is read from a "
        "temporary folder, which is removed at the end"
    )
    return Resolved(str(folder), (note,))


def _listed(client: WebClient, place: str, uuid: str) -> dict[str, int]:
    """Return the keys of a series' objects with their sizes in bytes (ListObjectsV2)."""
    sizes: dict[str, int] = {}
    token = ""
    for _ in range(_PAGES):
        query = {"list-type": "2", "prefix": f"{uuid}/"}
        if token:
            query["continuation-token"] = token
        body = client.fetch(f"{place}/?{urlencode(query)}", "application/xml")
        try:
            listing = ElementTree.fromstring(body)
        except ElementTree.ParseError:
            raise wrong_answer(client.shown, "no XML", "a listing of the bucket") from None
        for one in listing.iterfind("{*}Contents"):
            key, size = one.findtext("{*}Key") or "", one.findtext("{*}Size") or ""
            match = _KEY.fullmatch(key)
            if match is None or match["uuid"] != uuid or not re.fullmatch(r"\d{1,15}", size):
                raise wrong_answer(client.shown, f"key {key!r:.80}", "UUID/NAME.dcm")
            sizes[key] = int(size)
        token = listing.findtext("{*}NextContinuationToken") or ""
        if not token:
            break
    if not sizes:
        raise SourceError(f"{client.shown}: no such series, expected the UUID of a series")
    if token or len(sizes) > MAX_INSTANCES or sum(sizes.values()) > SERIES_BYTES:
        raise wrong_answer(
            client.shown,
            f"{len(sizes):,} files or more, of {sum(sizes.values()):,} bytes",
            f"at most {MAX_INSTANCES:,} files and {SERIES_BYTES >> 30} GiB",
        )
    return sizes

"""Image Data Resource: find the OME-Zarr of an image page.

The Resource stores OME-Zarr of some images at `zarr/v0.N/`. Version 0.3 and later are stored by
study, such as `idr0062A/6001240.zarr`, earlier versions by the image's number alone. The study
follows from the name of the image's project, such as
`idr0062-blin-nuclearsegmentation/experimentA`.
"""

import re
from typing import Any
from urllib.parse import parse_qs, urlsplit

from stereocell.model.errors import SourceError
from stereocell.read.addresses.resolved import NotThereError, Resolved, other_form
from stereocell.read.addresses.web_client import WebClient

PAGES = "https://idr.openmicroscopy.org"
DATA = (  # two names of one bucket; the second is asked if the first is down
    "https://livingobjects.ebi.ac.uk/idr/zarr",
    "https://uk1s3.embassy.ebi.ac.uk/idr/zarr",
)
FORMS = (
    "https://idr.openmicroscopy.org/webclient/?show=image-ID",
    "https://idr.openmicroscopy.org/webclient/img_detail/ID/",
    "https://idr.openmicroscopy.org/iviewer/?images=ID",
)
_SAMPLES = "https://idr.github.io/ome-ngff-samples/"
_HOST = "idr.openmicroscopy.org"
# versions of OME-Zarr in the order in which they are searched for
_VERSIONS = ("v0.5", "v0.4", "v0.3", "v0.2", "v0.1")
_STUDY = re.compile(r"(idr\d{4})\b.*?(?:/(?:experiment|screen)([A-Z]))?")
_ID = r"[1-9]\d{0,11}"


def resolve(address: str) -> Resolved | None:
    """Return the OME-Zarr of an image page; None: it is not one of the Resource's pages."""
    parts = urlsplit(address)
    if parts.hostname != _HOST or parts.scheme not in ("http", "https"):
        return None
    if not (number := _image_in(parts.path, parse_qs(parts.query))):
        raise other_form(address[:200], "the Image Data Resource", FORMS)
    client = WebClient([PAGES, *DATA], shown=f"IDR image {number}")
    studies = _studies(client, number)
    place = _find(client, studies, number)
    return Resolved(place, (f"IDR image {number} is read from {place}",))


def _find(client: WebClient, studies: list[str], number: str) -> str:
    """Return the address of an image's OME-Zarr, in the newest version that exists."""
    names = []
    for version in _VERSIONS:
        folders = [] if version in ("v0.1", "v0.2") else [f"{one}/" for one in studies]
        names += [f"{version}/{folder}{number}.zarr" for folder in (*folders, "")]
    for base in DATA:
        try:
            for name in names:
                file = "zarr.json" if name.startswith("v0.5") else ".zattrs"
                if client.is_there(f"{base}/{name}/{file}"):
                    return f"{base}/{name}"
        except SourceError:
            if base == DATA[-1]:
                raise
            continue
        break
    raise SourceError(
        f"IDR image {number}: found no OME-Zarr at {base} ({_VERSIONS[0]} to {_VERSIONS[-1]}), "
        f"expected an image that has one: {_SAMPLES} lists them; other images can be downloaded"
    )


def _image_in(path: str, query: dict[str, list[str]]) -> str:
    """Return the number of the image on a page; empty: another form, or several images."""
    shown = ""
    if re.fullmatch(r"/webclient/?(userdata/)?", path):
        shown = ",".join(query.get("show", [])).removeprefix("image-")
    elif re.fullmatch(r"/(webclient|webgateway)/img_detail/\d+/?", path):
        shown = path.rstrip("/").rpartition("/")[2]
    elif re.fullmatch(r"/(webclient/)?iviewer/?", path):
        shown = ",".join(query.get("images", []))
    return shown if re.fullmatch(_ID, shown) else ""


def _studies(client: WebClient, number: str) -> list[str]:
    """Return the folders of the image's study, from the names of its projects."""
    try:
        answer = client.fetch_json(f"{PAGES}/webclient/api/paths_to_object/?image={number}")
    except NotThereError:
        raise SourceError(
            f"IDR image {number}: not found, expected the number of an image"
        ) from None
    kept = answer.get("paths") if isinstance(answer, dict) else None
    steps = [step for path in _list(kept) for step in _list(path) if isinstance(step, dict)]
    found: dict[str, None] = {}
    for step in steps:
        kind, key = step.get("type"), step.get("id")
        if kind not in ("project", "screen") or not re.fullmatch(_ID, str(key)):
            continue
        answer = client.fetch_json(f"{PAGES}/api/v0/m/{kind}s/{key}/")
        data = answer.get("data") if isinstance(answer, dict) else None
        match = _STUDY.fullmatch(str(data.get("Name"))) if isinstance(data, dict) else None
        if match is not None:
            found |= dict.fromkeys([f"{match[1]}{match[2] or 'A'}", match[1]])
    return list(found)


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []

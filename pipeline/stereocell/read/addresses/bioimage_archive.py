"""BioImage Archive: find the OME-Zarr of an image page, or of a study with one image.

The archive's API lists the datasets of a study, their images, and each image's representations. The
representation with the format `.ome.zarr` has the address in `file_uri`.
"""

import re
from typing import Any
from urllib.parse import urlsplit

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.addresses.resolved import NotThereError, Resolved, other_form, wrong_answer
from stereocell.read.addresses.web_client import WebClient

API = "https://wwwdev.ebi.ac.uk/bioimage-archive/api/v2"  # the API behind the archive's own pages
# where the archive's OME-Zarr lies; an answer that leads elsewhere is refused
DATA = ("https://uk1s3.embassy.ebi.ac.uk", "https://livingobjects.ebi.ac.uk")
FORMS = (
    "https://www.ebi.ac.uk/bioimage-archive/image/UUID",
    "https://www.ebi.ac.uk/bioimage-archive/study/S-BIADn of one image",
    "https://uk1s3.embassy.ebi.ac.uk/bia-integrator-data/.../NAME.zarr",
)
_ZARR = re.compile(r"https?://(?!.*(?:\.\.|%2e|[^!-~]))[^?#]+\.zarr(?:/[^?#]*)?", re.I)
_FORMATS = (".ome.zarr", ".zarr")
_UUID = r"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}"
_ACCESSION = r"S-[A-Z]{3,6}\d{1,6}"
_HOST = re.compile(r"([\w-]+\.)*(ebi\.ac\.uk|bioimagearchive\.org)")
_OWN = re.compile(r"/(bioimage-archive|biostudies/bioimages|bia-integrator-data)(/.*)?", re.I)
_IMAGE = re.compile(rf"/bioimage-archive/(?:[\w-]+/)*image/({_UUID})/?", re.I)
_STUDY = re.compile(
    rf"/(?:bioimage-archive|biostudies|bia-integrator-data)/(?:[\w-]+/)*({_ACCESSION})"
    r"(?:-ai)?(?:\.html)?/?",
    re.I,
)


def resolve(address: str) -> Resolved | None:
    """Return the OME-Zarr of a page of the archive; None: the address is not one of its pages."""
    parts = urlsplit(address)
    if parts.scheme not in ("http", "https") or not _HOST.fullmatch(parts.hostname or ""):
        return None
    image, study = _IMAGE.fullmatch(parts.path), _STUDY.fullmatch(parts.path)
    client = WebClient([API], shown="BioImage Archive")
    if image is not None:
        return _image(client, image[1].lower())
    if study is not None:
        return _image(client, _only_image(client, study[1].upper()))
    if _OWN.fullmatch(parts.path) or "S-BIAD" in address:
        raise other_form(address[:200], "the BioImage Archive", FORMS)
    return None


def _only_image(client: WebClient, accession: str) -> str:
    """Return the UUID of the only image in a study."""
    missing = SourceError(f"BioImage Archive: {accession}: not found, expected a study with images")
    try:
        study = client.fetch_json(
            f"{API}/search/study/accession?accession_id={accession}&page_size=1"
        )
    except NotThereError:
        raise missing from None
    if isinstance(study, list):
        study = study[0] if study else None
    if study is None:
        raise missing
    images: list[str] = []
    datasets = client.fetch_json(f"{API}/study/{_uuid_of(client, study)}/dataset?page_size=100")
    for dataset in _rows(client, datasets):
        uuid = _uuid_of(client, dataset)
        found = client.fetch_json(f"{API}/dataset/{uuid}/image?page_size=100")
        images += [_uuid_of(client, one) for one in _rows(client, found)]
    if not images:
        raise SourceError(f"BioImage Archive: {accession}: found no image, expected one")
    if len(images) > 1:
        raise UsageError(
            f"BioImage Archive: {accession}: found a study of {len(images)} images or more, "
            f"expected the page of one image: {FORMS[0]}"
        )
    return images[0]


def _image(client: WebClient, uuid: str) -> Resolved:
    try:
        answer = client.fetch_json(f"{API}/image/{uuid}/image_representation?page_size=100")
    except NotThereError:
        raise SourceError(f"BioImage Archive: image {uuid}: not found, expected an image") from None
    rows = [row for row in _rows(client, answer) if isinstance(row, dict)]
    found = [row.get("file_uri") for row in rows if row.get("image_format") in _FORMATS]
    lists = [one for one in found if isinstance(one, list)]
    places = [place for one in lists for place in one if isinstance(place, str)]
    if not places:
        raise SourceError(
            f"BioImage Archive: image {uuid}: found no OME-Zarr, expected one: the image's page "
            "may offer the file to download"
        )
    place = places[0]
    if not place.startswith(tuple(f"{base}/" for base in DATA)) or not _ZARR.fullmatch(place):
        raise wrong_answer(
            client.shown, f"file_uri {place!r:.120}", f"an OME-Zarr below {' or '.join(DATA)}"
        )
    return Resolved(place, (f"BioImage Archive image {uuid} is read from {place}",))


def _rows(client: WebClient, answer: Any) -> list[Any]:
    if not isinstance(answer, list):
        raise wrong_answer(client.shown, "no list", "a list")
    return answer


def _uuid_of(client: WebClient, row: Any) -> str:
    uuid = str(row.get("uuid")) if isinstance(row, dict) else ""
    if not re.fullmatch(_UUID, uuid):
        raise wrong_answer(client.shown, f"uuid {uuid!r:.60}", "a UUID")
    return uuid

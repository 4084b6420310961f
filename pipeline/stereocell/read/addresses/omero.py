"""Links of OMERO and of OME-Zarr viewers: find the image that `?source=` names."""

import re
from urllib.parse import parse_qs, urlsplit

from stereocell.model.errors import UsageError
from stereocell.read.addresses.resolved import Resolved, other_form
from stereocell.storage.public_hosts import require_public

FORMS = (
    "https://HOST/.../vizarr/?source=ADDRESS",
    "https://ome.github.io/ome-ngff-validator/?source=ADDRESS",
    "an address of OME-Zarr",
)
_VIEWER = re.compile(r"vizarr|ome-ngff-validator", re.I)
_OMERO_WEB = re.compile(r"/(?:webclient|webgateway|iviewer)(?:/.*)?", re.I)


def resolve(address: str) -> Resolved | None:
    """Return the image that a viewer's link names; None: the address is not such a link."""
    parts = urlsplit(address)
    if parts.scheme not in ("http", "https"):
        return None
    if _OMERO_WEB.fullmatch(parts.path):
        raise UsageError(
            f"{parts.scheme}://{parts.hostname}: found a page of OMERO.web, which offers rendered "
            f"images but no voxels, expected {' or '.join(FORMS)}"
        )
    is_viewer = _VIEWER.search(f"{parts.hostname}{parts.path}") is not None
    is_page = parts.path.endswith("/index.html")  # a page of StereoCell itself
    if (not is_viewer and not is_page) or parts.path.lower().endswith(".zarr"):
        return None
    found = [*parse_qs(parts.query).get("source", []), *_behind_hash(parts.fragment)]
    if not found:
        if is_page:
            return None
        raise other_form(address[:200], "a viewer of OME-Zarr", FORMS)
    if len(found) > 1:
        raise UsageError(
            f"{parts.hostname}: found a link to {len(found)} images, expected one source="
        )
    place = found[0]
    if not place.startswith(("http://", "https://", "s3://")) or not place.isprintable():
        raise UsageError(
            f"{parts.hostname}: found source={place!r:.120}, expected an http(s) or s3 address"
        )
    require_public(place)
    where = urlsplit(place)
    shown = f"{where.scheme}://{where.netloc.rpartition('@')[2]}{where.path}"
    return Resolved(place, (f"the link's image is read from {shown}",))


def _behind_hash(fragment: str) -> list[str]:
    return parse_qs(urlsplit(fragment).query).get("source", [])

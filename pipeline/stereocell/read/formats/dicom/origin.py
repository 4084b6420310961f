"""A digest of the study and series that an image states beside its SeriesInstanceUID.

De-identification may replace that UID in each file. The digest shows whether two images may still
come from one series. The texts themselves are not stored.
"""

import hashlib
from dataclasses import dataclass
from typing import Any

from stereocell.read.formats.dicom.header_values import find_text

_DESCRIPTIONS = ("SeriesDescription", "ProtocolName")
ORIGIN_TAGS: list[Any] = ["StudyInstanceUID", "SeriesNumber", *_DESCRIPTIONS]


@dataclass(frozen=True, slots=True)
class Origin:
    """The origin of an image.

    digest      digest of the study's UID, and of the series' number and descriptions
    is_counted  whether the number of the series is stated
    """

    digest: bytes = b""
    is_counted: bool = False


def origin_of(header: Any) -> Origin:
    """Return the origin that a header states."""
    texts = [find_text(header, (), "", name) for name in ORIGIN_TAGS]
    return Origin(hashlib.sha256("\0".join(texts).encode()).digest(), bool(texts[1]))

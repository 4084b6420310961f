"""The study and the series that an image states beside its SeriesInstanceUID, as a digest.

De-identification may replace that UID in each file anew. The digest tells whether two images may
come from one series all the same. The texts themselves go nowhere.
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

    digest      of the study's UID, the number of the series and its descriptions
    is_counted  the number of the series is stated
    """

    digest: bytes = b""
    is_counted: bool = False


def origin_of(header: Any) -> Origin:
    """Return the origin that a header states."""
    texts = [find_text(header, (), "", name) for name in ORIGIN_TAGS]
    return Origin(hashlib.sha256("\0".join(texts).encode()).digest(), bool(texts[1]))

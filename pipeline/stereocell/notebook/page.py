"""The viewer's page for a frame in a notebook: one document, and the files that it needs.

The frame has no origin and no address. Its script `frame.js` therefore requests the bundle's files
from the kernel.
"""

import hashlib
from functools import cache
from pathlib import Path

from stereocell.bundle import blob_page

_FRAME = Path(__file__).with_name("frame.js")


def document() -> str:
    """Return the HTML document for the frame in a notebook."""
    return blob_page.document(_FRAME)


@cache
def key() -> str:
    """Return a key of this version of the page, by which a notebook caches the page's files."""
    digest = hashlib.sha256(document().encode())
    digest.update("\n".join(blob_page.files()).encode())
    return digest.hexdigest()[:16]

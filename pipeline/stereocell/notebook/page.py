"""The viewer's page as a notebook's frame has it: one document, and the files that it takes.

The frame has no origin and no address: `frame.js` asks the kernel for the bundle's files.
"""

import hashlib
from functools import cache
from pathlib import Path

from stereocell.bundle import blob_page

_FRAME = Path(__file__).with_name("frame.js")


def document() -> str:
    """Return the frame's document."""
    return blob_page.document(_FRAME)


@cache
def key() -> str:
    """Return what tells this page from others: a view that comes again need not ask for it."""
    digest = hashlib.sha256(document().encode())
    digest.update("\n".join(blob_page.files()).encode())
    return digest.hexdigest()[:16]

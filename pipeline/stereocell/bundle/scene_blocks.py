"""Write and read the blocks of scene.html, a scene in one file.

`export` writes the blocks, and `check` reads them. A block is a script element that browsers do not
run. It holds a file as base64, and the SHA-256 of the file's bytes. The rest of the document is the
page: a policy and a script that runs.
"""

import base64
import binascii
import hashlib
import html
import re
import zlib
from dataclasses import dataclass, field

from stereocell.model.errors import OutputError

PAGE, FILE = "page", "file"  # kinds of blocks, for a file of the viewer and one of the bundle
REMEDY = "copy the file again, or run `stereocell export OUT scene.html` again"
# Fragment of a link to a view, as viewer_gltf/src/share/permalink.ts writes it
VIEW = re.compile(r"#v=\d+(&[\w.~:;,=!*'()%+/@$?-]*)*", re.ASCII)
_VIEW_BLOCK = re.compile(r' *<script type="text/plain" data-view>([^<]*)</script>\n')
_BLOCK = re.compile(
    r' *<script type="application/octet-stream" data-(page|file)="([^"<>]*)"'
    r' data-bytes="(\d+)" data-sha256="([0-9a-f]{64})"( data-packed)?>([^<]*)</script>\n'
)
# Largest size of all unpacked files / size of the document. Tables of objects, which shrink the
# most, have a ratio of 20.
_MAX_GROWTH = 50


@dataclass(frozen=True, slots=True)
class SceneBlocks:
    """The content of a scene in one file.

    page   files of the viewer by name; some are gzip, as the viewer's build packed them
    files  files of the bundle by path, unpacked
    view   fragment of a link to the view at opening; empty: the default view of the bundle
    rest   the document without its blocks
    """

    page: dict[str, bytes] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)
    view: str = ""
    rest: str = ""


def block(kind: str, name: str, data: bytes, is_packed: bool) -> str:
    """Return the script element that holds a file in the document.

    is_packed  whether `data` is gzip and the reader shall unpack it
    """
    attributes = f'data-{kind}="{html.escape(name)}" data-bytes="{len(data)}"'
    attributes += f' data-sha256="{hashlib.sha256(data).hexdigest()}"'
    packed = " data-packed" if is_packed else ""
    text = base64.b64encode(data).decode()
    return f'    <script type="application/octet-stream" {attributes}{packed}>{text}</script>\n'


def view_block(view: str) -> str:
    """Return the element with the camera view at opening; an empty text for an empty view."""
    return f'    <script type="text/plain" data-view>{view}</script>\n' if view else ""


def read_blocks(document: str) -> SceneBlocks:
    """Return the files in a document. Raises OutputError for a damaged or repeated block."""
    found = SceneBlocks(view="".join(_VIEW_BLOCK.findall(document)))
    room = _MAX_GROWTH * len(document)
    for kind, escaped, size, digest, packed, text in _BLOCK.findall(document):
        name = html.unescape(escaped)
        kept = found.page if kind == PAGE else found.files
        if name in kept:
            raise OutputError(f"{name}: found two blocks, expected one: {REMEDY}")
        data = _decoded(name, text, int(size), digest)
        kept[name] = _unpacked(name, data, room) if packed else data
        room -= len(kept[name])
    rest = _VIEW_BLOCK.sub("", _BLOCK.sub("", document))
    return SceneBlocks(found.page, found.files, found.view, rest)


def _decoded(name: str, text: str, size: int, digest: str) -> bytes:
    try:
        data = base64.b64decode(text, validate=True)
    except binascii.Error:
        raise OutputError(f"{name}: found a damaged block, expected base64: {REMEDY}") from None
    if len(data) != size:
        raise OutputError(f"{name}: found {len(data)} bytes, expected {size}: {REMEDY}")
    found = hashlib.sha256(data).hexdigest()
    if found != digest:
        raise OutputError(f"{name}: found SHA-256 {found}, expected {digest}: {REMEDY}")
    return data


def _unpacked(name: str, data: bytes, most: int) -> bytes:
    """Unpack gzip data. Raises OutputError if the result has more than `most` bytes."""
    unpacker = zlib.decompressobj(wbits=zlib.MAX_WBITS | 16)
    try:
        content = unpacker.decompress(data, max(1, most))
    except zlib.error:
        raise OutputError(f"{name}: found damaged data, expected gzip: {REMEDY}") from None
    if not unpacker.eof:
        raise OutputError(
            f"{name}: found cut-off data, or more than {most} bytes, expected a whole and smaller "
            f"file: {REMEDY}"
        )
    return content

"""Search a folder for words that must not be in it, in any form that a program may write them.

Forms: plain in any case, UTF-16 of both byte orders, hex, and base64 at each of its three
alignments. The search covers names of files, their bytes, and the unpacked content of zip, gzip,
zstd, zlib and PNG. Binary layers of USD, whose words are packed, are searched as text.
"""

import base64
import gzip
import io
import re
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import zstandard
from PIL import Image
from pxr import Sdf

_ZSTD = b"\x28\xb5\x2f\xfd"
_DATA_URI = re.compile(rb"(?:base64,|octet-stream\"[^>]*>)([A-Za-z0-9+/=]{40,})")


def forms(word: str) -> dict[str, re.Pattern[bytes]]:
    raw = word.encode()
    found = {
        "bytes": raw,
        "UTF-16LE": word.encode("utf-16-le"),
        "UTF-16BE": word.encode("utf-16-be"),
        "hex": raw.hex().encode(),
    }
    patterns = {name: re.compile(re.escape(form), re.IGNORECASE) for name, form in found.items()}
    for shift in range(3):  # bytes before it fill up the first group of three
        text = base64.b64encode(bytes(shift) + raw).rstrip(b"=")
        own = text[-(-shift * 8 // 6) : (shift + len(raw)) * 8 // 6]
        patterns[f"base64+{shift}"] = re.compile(re.escape(own))
    return patterns


def find(folder: Path, words: list[str], texts: dict[str, str] | None = None) -> list[str]:
    """Return the places of words, as `word as form in place`. `texts` are searched as well."""
    wanted = [(word, name, p) for word in words for name, p in forms(word).items()]
    hits = []
    given = {name: text.encode() for name, text in (texts or {}).items()}
    for place, content in [*given.items(), *_contents(folder)]:
        hits += [f"{word} as {form} in {place}" for word, form, p in wanted if p.search(content)]
    return hits


def _contents(folder: Path) -> Iterator[tuple[str, bytes]]:
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        yield f"the name {name}", name.encode()
        if path.is_file():
            yield from _unpacked(name, path.read_bytes())
            if path.suffix in (".usdc", ".usda", ".usd"):
                yield (
                    f"{name} as text",
                    Sdf.Layer.OpenAsAnonymous(str(path)).ExportToString().encode(),
                )


def _unpacked(name: str, content: bytes) -> Iterator[tuple[str, bytes]]:
    yield name, content
    if content[:4] == b"PK\3\4":
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            for member in archive.namelist():
                yield from _unpacked(f"{name}:{member}", archive.read(member))
    elif content[:2] == b"\x1f\x8b":
        yield from _unpacked(f"{name} unpacked", gzip.decompress(content))
    elif content[:8] == b"\x89PNG\r\n\x1a\n":
        with Image.open(io.BytesIO(content)) as image:
            image.load()
            yield f"{name}: texts", repr(image.info).encode()
            yield f"{name}: pixels", np.asarray(image).tobytes()
    elif name.endswith(".vdb"):
        for start in _starts(content, b"\x78\x9c", b"\x78\x01", b"\x78\xda"):
            try:
                yield f"{name} at {start}", zlib.decompressobj().decompress(content[start:])
            except zlib.error:
                continue
    for start in _starts(content, _ZSTD):
        try:
            reader = zstandard.ZstdDecompressor().stream_reader(content[start:])
            yield f"{name} at {start}", reader.read()
        except zstandard.ZstdError:
            continue
    for match in _DATA_URI.finditer(content):
        inner = base64.b64decode(match[1] + b"==")
        yield from _unpacked(f"{name}: data at {match.start()}", inner)


def _starts(content: bytes, *magics: bytes) -> list[int]:
    return [m.start() for magic in magics for m in re.finditer(re.escape(magic), content)]

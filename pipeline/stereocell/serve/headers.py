"""Headers of every answer that restrict the use of this server's content in a browser.

The viewer's page has its own Content-Security-Policy in its <meta>, with the hash of its script.
The header adds the directives that only a header can set. Scripts get the same header, since
workers take their policy from it. All other files of a bundle are data: if a person opens one
directly (an SVG, say), it can neither run scripts nor load anything. The server sends no
Cross-Origin-Embedder-Policy: the viewer shares no memory between threads, and may read a bundle of
another host.

References: W3C Content Security Policy Level 3.
"""

from collections.abc import Iterable

_EVERYWHERE = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}
_NO_FRAME = "frame-ancestors 'none'"
_PAGE = f"base-uri 'none'; form-action 'none'; {_NO_FRAME}; object-src 'none'"
_DATA = f"default-src 'none'; style-src 'unsafe-inline'; {_NO_FRAME}; sandbox"
_RUN = ("text/html", "text/javascript")

RawHeaders = list[tuple[bytes, bytes]]


def protect(headers: Iterable[tuple[bytes, bytes]], frames: Iterable[str] = ()) -> RawHeaders:
    """Return an answer's headers, names in lower case, with the protective ones added.

    frames  origins whose pages may hold the viewer's page in a frame
    """
    allowed = " ".join(frames)
    made = [(name, _framed(value, allowed)) for name, value in headers]
    found = {name for name, _ in made}
    for name, value in (_EVERYWHERE | policy("")).items():
        if (raw := name.lower().encode()) not in found:
            made.append((raw, value.encode()))
    return made


def policy(content_type: str) -> dict[str, str]:
    """Return the policy header of a file.

    A 304 answer must repeat it, since caches replace stored headers by those of a 304.
    """
    runs = content_type.partition(";")[0] in _RUN
    return {"Content-Security-Policy": _PAGE if runs else _DATA}


def _framed(value: bytes, allowed: str) -> bytes:
    """Add the origins that may frame the page to its policy; return any other value unchanged."""
    if not allowed or value != _PAGE.encode():
        return value
    return value.replace(_NO_FRAME.encode(), f"frame-ancestors {allowed}".encode())

"""Headers of every answer that tell a browser what this server's content may not be used for.

The viewer's page brings its own Content-Security-Policy in its <meta>, with the hash of its script;
the header adds what only a header can say. Scripts get the same: workers take theirs from it. All
else in a bundle is data: opened by itself (an SVG, say), it runs and loads nothing. There is no
Cross-Origin-Embedder-Policy: the viewer shares no memory, and may read a bundle of another host.
"""

from collections.abc import Iterable

_EVERYWHERE = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}
_PAGE = "base-uri 'none'; form-action 'none'; frame-ancestors 'none'; object-src 'none'"
_DATA = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; sandbox"
_RUN = ("text/html", "text/javascript")

RawHeaders = list[tuple[bytes, bytes]]


def protect(headers: Iterable[tuple[bytes, bytes]]) -> RawHeaders:
    """Return an answer's headers, their names in lower case, with those that all answers have."""
    made = list(headers)
    found = {name for name, _ in made}
    for name, value in (_EVERYWHERE | policy("")).items():
        if (raw := name.lower().encode()) not in found:
            made.append((raw, value.encode()))
    return made


def policy(content_type: str) -> dict[str, str]:
    """Return the policy of a file, which its 304 must repeat: caches take a 304's headers over."""
    runs = content_type.partition(";")[0] in _RUN
    return {"Content-Security-Policy": _PAGE if runs else _DATA}

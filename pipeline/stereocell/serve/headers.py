"""Headers of every answer that restrict the use of this server's content in a browser.

The viewer's page has its own Content-Security-Policy in its <meta>, with the hash of its script;
the header adds the directives that only a header can set. Scripts get the same, since workers take
their policy from it. All other files of a bundle are data: opened directly (an SVG, say), they run
and load nothing. There is no Cross-Origin-Embedder-Policy: the viewer shares no memory, and may
read a bundle of another host.

References: W3C Content Security Policy Level 3.
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
    """Return an answer's headers (names in lower case) with the common ones added."""
    made = list(headers)
    found = {name for name, _ in made}
    for name, value in (_EVERYWHERE | policy("")).items():
        if (raw := name.lower().encode()) not in found:
            made.append((raw, value.encode()))
    return made


def policy(content_type: str) -> dict[str, str]:
    """Return the policy of a file; its 304 must repeat it, since caches take a 304's headers."""
    runs = content_type.partition(";")[0] in _RUN
    return {"Content-Security-Policy": _PAGE if runs else _DATA}

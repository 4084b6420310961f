"""Check the redirects that a source's host sends while fsspec reads from it by aiohttp."""

import asyncio
from functools import cache
from types import SimpleNamespace

from aiohttp import ClientSession, TraceConfig, TraceRequestRedirectParams

from stereocell.storage.public_hosts import require_public_redirect


@cache
def checks() -> list[TraceConfig]:
    """Return the checks of a session, the same ones each time: fsspec keeps a session by them."""
    config = TraceConfig()
    config.on_request_redirect.append(_check)
    return [config]


async def _check(
    _session: ClientSession, _context: SimpleNamespace, found: TraceRequestRedirectParams
) -> None:
    """Raise SourceError where a redirect leads from a public host into a private network."""
    headers = found.response.headers
    target = headers.get("Location") or headers.get("URI") or ""
    # it looks names up, which may take seconds
    await asyncio.to_thread(require_public_redirect, str(found.url), target)

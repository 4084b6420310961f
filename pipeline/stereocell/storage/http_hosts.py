"""Check the hosts to which fsspec connects by aiohttp: redirects, and for strangers each one."""

import asyncio
import socket
from functools import cache
from types import SimpleNamespace
from typing import Any

from aiohttp import ClientSession, TCPConnector, TraceConfig, TraceRequestRedirectParams
from aiohttp.connector import AddrInfoType

from stereocell.storage.public_hosts import require_public_numbers, require_public_redirect


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


async def public_client(**options: Any) -> ClientSession:
    """Return a session whose connections go to public IP addresses alone."""
    return ClientSession(connector=TCPConnector(socket_factory=_public_socket), **options)


def _public_socket(found: AddrInfoType) -> socket.socket:
    """Return the socket for an IP address. Raises SourceError where that is not public."""
    family, kind, protocol, _, address = found
    number = str(address[0])
    require_public_numbers(number, [number])
    return socket.socket(family, kind, protocol)

"""Check the hosts to which fsspec connects by aiohttp.

Redirects are always checked. In a process that reads for a stranger, each connection is checked.
"""

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
    """Return the checks of a session.

    It is the same object each time, because fsspec reuses a session if its options are the same.
    """
    config = TraceConfig()
    config.on_request_redirect.append(_check)
    return [config]


async def _check(
    _session: ClientSession, _context: SimpleNamespace, found: TraceRequestRedirectParams
) -> None:
    """Raise SourceError if a redirect leads from a public host into a private network."""
    headers = found.response.headers
    target = headers.get("Location") or headers.get("URI") or ""
    # in a thread, because looking up names may take seconds
    await asyncio.to_thread(require_public_redirect, str(found.url), target)


async def public_client(**options: Any) -> ClientSession:
    """Return a session that only connects to public IP addresses."""
    return ClientSession(connector=TCPConnector(socket_factory=_public_socket), **options)


def _public_socket(found: AddrInfoType) -> socket.socket:
    """Return the socket for an IP address. Raises SourceError if the address is not public."""
    family, kind, protocol, _, address = found
    number = str(address[0])
    require_public_numbers(number, [number])
    return socket.socket(family, kind, protocol)

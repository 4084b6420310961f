"""Refuse addresses in private networks if a server's answer leads to them.

Users may name any host, even one in their own network. But a redirect or a link in a server's
answer could point at a machine that only this one can reach. Examples are a router, and the
metadata service of a cloud. Such an address is refused. The message shows it, so that users who
trust it can name it themselves.

A process that reads for a stranger only connects to public hosts (`connect_to_public_alone`). There
each connection is checked by its IP address, because a name may lead to another address each time
it is looked up.
"""

import ipaddress
import os
import socket
from collections.abc import Iterable
from urllib.parse import SplitResult, urljoin, urlsplit

from stereocell.model.errors import SourceError

# Networks of IPv6 whose addresses hold one of IPv4, for gateways and for old systems
_OF_IPV4 = (ipaddress.ip_network("64:ff9b::/96"), ipaddress.ip_network("::/96"))
_PORTS = {"http": 80, "https": 443}
_ALONE = "STEREOCELL_PUBLIC_HOSTS"  # environment variable, which workers inherit


def split_address(address: str) -> SplitResult:
    """Return the parts of an http address. Raises SourceError for others, and for user names."""
    try:
        parts = urlsplit(address)
        port, host = parts.port, parts.hostname
    except ValueError as error:
        raise SourceError(
            f"{address:.200}: found no valid address ({error}), expected https://"
        ) from None
    if parts.scheme not in _PORTS or not host or port == 0:
        raise SourceError(f"{address:.200}: found no http address, expected https://")
    if "@" in parts.netloc:
        raise SourceError(
            f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}: found a user name in the "
            "address, expected an address without one"
        )
    return parts


def origin_of(address: str) -> tuple[str, str, int]:
    """Return scheme, host and port of an http address. Raises SourceError for other addresses."""
    parts = split_address(address)
    return parts.scheme, parts.hostname or "", parts.port or _PORTS[parts.scheme]


def is_public(number: str) -> bool:
    """Return whether an IP address belongs to the public internet."""
    address = ipaddress.ip_address(number.partition("%")[0])  # without the zone of IPv6
    if isinstance(address, ipaddress.IPv6Address):
        inner = address.ipv4_mapped or address.sixtofour
        if address.teredo is not None:
            inner = address.teredo[1]
        elif any(address in network for network in _OF_IPV4):
            inner = ipaddress.IPv4Address(int(address) & 0xFFFFFFFF)
        if inner is not None:
            return is_public(str(inner))
    return address.is_global and not address.is_multicast


def numbers_of(address: str) -> list[str]:
    """Return the IP addresses of an address's host. Raises SourceError if it has none."""
    _, host, port = origin_of(address)
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        raise SourceError(
            f"{host:.200}: found no such host, or no network, expected a host that is running"
        ) from None
    numbers = [str(one[4][0]) for one in found]
    if connects_to_public_alone():
        require_public_numbers(host, numbers)
    return numbers


def connect_to_public_alone() -> None:
    """Keep this process, and those that it starts, from opening addresses in private networks."""
    os.environ[_ALONE] = "alone"


def connects_to_public_alone() -> bool:
    """Return whether this process only opens public addresses."""
    return os.environ.get(_ALONE) == "alone"


def require_public_numbers(host: str, numbers: Iterable[str]) -> None:
    """Raise SourceError if one of a host's IP addresses is not public."""
    if not all(map(is_public, numbers)):
        raise SourceError(f"{host:.200}: leads into a private network, expected a public address")


def public_numbers_of(address: str) -> list[str]:
    """Return the IP addresses of the host that a server's answer names.

    Raises SourceError if one of them is not public.
    """
    numbers = numbers_of(address)
    if not all(map(is_public, numbers)):
        raise SourceError(
            f"{address:.200}: a server's answer leads into a private network, expected a public "
            "address: if you trust this address, name it yourself"
        )
    return numbers


def require_public(address: str) -> None:
    """Raise SourceError unless an address from an answer is s3, or http(s) of a public host."""
    if not address.startswith("s3://"):
        public_numbers_of(address)


def require_public_redirect(address: str, target: str) -> None:
    """Raise SourceError if a public host redirects into a private network.

    A host in a private network, which the user has named, may redirect within it.
    """
    target = urljoin(address, target)
    if origin_of(target)[:2] != origin_of(address)[:2] and all(map(is_public, numbers_of(address))):
        public_numbers_of(target)

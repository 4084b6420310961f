"""Which hosts a server's answer may lead to: public ones alone.

A person may name any host, also one in the own network. An answer of a server is another matter: a
redirect or a link in it could point at a machine that only this one reaches (a router, the metadata
service of a cloud). Such an address is refused. The message shows it, so that a person who trusts
it can name it.

A process that reads for a stranger connects to public hosts alone: see `connect_to_public_alone`.
There each connection is checked by the IP address that it goes to, since a name may have another
one each time it is looked up.
"""

import ipaddress
import os
import socket
from collections.abc import Iterable
from urllib.parse import SplitResult, urljoin, urlsplit

from stereocell.model.errors import SourceError

# addresses that hold one of IPv4: a gateway translates the former, and old systems the latter
_OF_IPV4 = (ipaddress.ip_network("64:ff9b::/96"), ipaddress.ip_network("::/96"))
_PORTS = {"http": 80, "https": 443}
_ALONE = "STEREOCELL_PUBLIC_HOSTS"  # in the environment, which a process hands on to its workers


def split_address(address: str) -> SplitResult:
    """Return the parts of an http address. Raises SourceError for others, and for user names."""
    try:
        parts = urlsplit(address)
        port, host = parts.port, parts.hostname
    except ValueError as error:
        raise SourceError(
            f"{address:.200}: found no address ({error}), expected https://"
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
    """Return the IP addresses of an address's host. Raises SourceError where it has none."""
    _, host, port = origin_of(address)
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        raise SourceError(
            f"{host:.200}: no such host, or no network, expected a host that is up"
        ) from None
    numbers = [str(one[4][0]) for one in found]
    if connects_to_public_alone():
        require_public_numbers(host, numbers)
    return numbers


def connect_to_public_alone() -> None:
    """Let this process, and those that it starts, open no address in a private network."""
    os.environ[_ALONE] = "alone"


def connects_to_public_alone() -> bool:
    """Return whether this process opens public addresses alone."""
    return os.environ.get(_ALONE) == "alone"


def require_public_numbers(host: str, numbers: Iterable[str]) -> None:
    """Raise SourceError where one of a host's IP addresses is not public."""
    if not all(map(is_public, numbers)):
        raise SourceError(f"{host:.200}: leads into a private network, expected a public address")


def public_numbers_of(address: str) -> list[str]:
    """Return the IP addresses of the host that a server's answer names.

    Raises SourceError where one of them is not public.
    """
    numbers = numbers_of(address)
    if not all(map(is_public, numbers)):
        raise SourceError(
            f"{address:.200}: a server's answer leads into a private network, expected a public "
            "address: if you trust it, name this address yourself"
        )
    return numbers


def require_public(address: str) -> None:
    """Raise SourceError for a data address from an answer that is neither http(s) nor s3, or whose
    host is in a private network.
    """
    if not address.startswith("s3://"):
        public_numbers_of(address)


def require_public_redirect(address: str, target: str) -> None:
    """Raise SourceError where a public host redirects into a private network.

    A host in a private network that a person has named may redirect within it.
    """
    target = urljoin(address, target)
    if origin_of(target)[:2] != origin_of(address)[:2] and all(map(is_public, numbers_of(address))):
        public_numbers_of(target)

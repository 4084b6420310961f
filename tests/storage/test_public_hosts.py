"""An address in a server's answer must be public, however its host is written."""

import socket
from typing import Any

import pytest

from stereocell.model.errors import SourceError
from stereocell.storage.public_hosts import (
    is_public,
    public_numbers_of,
    require_public,
    split_address,
)

PRIVATE = [
    *("127.0.0.1", "127.8.8.8", "0.0.0.0", "10.0.0.1", "172.16.0.1", "172.31.255.255"),
    *("192.168.1.1", "169.254.169.254", "100.64.0.1", "224.0.0.1", "255.255.255.255"),
    *("192.0.2.1", "198.18.0.1", "240.0.0.1"),
    *("::1", "::", "fe80::1", "fe80::1%eth0", "fc00::1", "fd12:3456::1", "ff02::1"),
    *("::ffff:127.0.0.1", "::ffff:10.0.0.1", "64:ff9b::7f00:1", "64:ff9b::a9fe:a9fe"),
    *("::127.0.0.1", "::a00:1", "::1", "::"),
    *("2002:7f00:1::", "2002:c0a8:101::1"),  # 6to4
]
PUBLIC = ["8.8.8.8", "193.62.193.80", "2001:4860:4860::8888", "::ffff:8.8.8.8", "64:ff9b::808:808"]


@pytest.mark.parametrize("number", PRIVATE)
def test_private_ip_addresses_are_not_public(number: str) -> None:
    assert not is_public(number)


@pytest.mark.parametrize("number", PUBLIC)
def test_public_ip_addresses_are_public(number: str) -> None:
    assert is_public(number)


@pytest.mark.parametrize(
    "host",
    [
        *("127.0.0.1", "localhost", "LOCALHOST", "2130706433", "0x7f000001", "0177.0.0.1", "127.1"),
        *("[::1]", "[::ffff:127.0.0.1]", "[fd00::1]", "169.254.169.254", "0"),
    ],
)
def test_a_host_in_a_private_network_is_refused_however_it_is_written(host: str) -> None:
    with pytest.raises(SourceError, match="private network"):
        public_numbers_of(f"http://{host}/a")


def test_a_host_name_that_leads_into_a_private_network_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    answers = {"rebound.example": ["93.184.215.14", "10.0.0.7"], "open.example": ["93.184.215.14"]}

    def getaddrinfo(host: str, port: int, **options: Any) -> list[Any]:
        return [(0, 0, 0, "", (number, port)) for number in answers[host]]

    monkeypatch.setattr(socket, "getaddrinfo", getaddrinfo)
    assert public_numbers_of("https://open.example/x") == ["93.184.215.14"]
    require_public("s3://bucket/x.zarr")
    with pytest.raises(SourceError, match="name it yourself"):
        require_public("https://rebound.example/x.zarr")


@pytest.mark.parametrize(
    "address",
    [
        *("file:///etc/passwd", "ftp://host/a", "gopher://host/", "https://", "http:///a"),
        *("http://host:0/", "http://host:99999/", "http://[::1/", "data:text/plain,a", "//host/a"),
    ],
)
def test_addresses_that_are_not_http_are_refused(address: str) -> None:
    with pytest.raises(SourceError, match="expected https://"):
        split_address(address)


def test_a_user_name_is_refused_and_not_shown() -> None:
    with pytest.raises(SourceError, match="user name") as caught:
        split_address("https://me:hunter2@host.example/a")
    assert "hunter2" not in str(caught.value)

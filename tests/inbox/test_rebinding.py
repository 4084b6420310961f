"""A host name from a stranger leads only to a public host, even if its IP address changes."""

import os
import socket
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from stereocell import read
from stereocell.cli.inbox_build import make_inbox_build
from stereocell.inbox import inbox as inbox_module
from stereocell.inbox.choices import Choices
from stereocell.model.errors import SourceError
from stereocell.read.addresses.resolved import Resolved
from stereocell.read.addresses.web_client import WebClient
from stereocell.serve import inbox_app
from stereocell.storage.public_hosts import connect_to_public_alone, numbers_of
from support.phantoms import f_phantom, write_ome_tiff
from support.recorded_service import Service
from support.recorded_service import serving as serving_answers
from support.server.inbox_client import InboxClient, serving_inbox

PUBLIC, INNER = "93.184.216.34", "127.0.0.1"
NAME = "rebound.example"
real_look_up = socket.getaddrinfo


class NameServer:
    """An attacker's name server: it gives NAME a public address first, and then a private one.

    public  number of look-ups that get the public address
    """

    def __init__(self, public: int) -> None:
        self.public, self.asked = public, 0

    def __call__(self, host: Any, port: Any, *args: Any, **options: Any) -> list[Any]:
        """Answer as `socket.getaddrinfo` does."""
        if host != NAME:
            return real_look_up(host, port, *args, **options)
        self.asked += 1
        number = PUBLIC if self.asked <= self.public else INNER
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (number, int(port)))]


@pytest.fixture
def rebind(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[int], NameServer]]:
    """Return a function that gives NAME a public address for the stated number of look-ups."""

    def begin(public: int) -> NameServer:
        names = NameServer(public)
        monkeypatch.setattr(socket, "getaddrinfo", names)
        return names

    with patch.dict(os.environ):
        yield begin


@pytest.fixture
def inner(tmp_path: Path) -> Iterator[Service]:
    """A host in the private network, with images."""
    image = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom())
    with serving_answers() as service:
        service.put("/f.ome.tif", image.read_bytes(), Accept_Ranges="bytes")
        service.json("/a.zarr/zarr.json", {"zarr_format": 3})
        yield service


def address_of(inner: Service, path: str) -> str:
    return f"http://{NAME}:{inner.url.rpartition(':')[2]}/{path}"


@pytest.mark.parametrize("path", ["a.zarr", "f.ome.tif"])
@pytest.mark.parametrize("public", [0, 1, 2])
def test_a_reader_for_a_stranger_does_not_ask_an_inner_host(
    rebind: Callable[[int], NameServer], inner: Service, path: str, public: int
) -> None:
    names = rebind(0)
    with suppress(SourceError):
        read.open(address_of(inner, path))
    assert inner.asked  # a person at this machine may name any host
    inner.asked.clear()
    connect_to_public_alone()
    names.asked, names.public = 0, public
    with pytest.raises(SourceError):
        read.open(address_of(inner, path))
    assert (inner.asked, names.asked > 0) == ([], True)


def test_a_private_host_is_asked_neither_by_its_ip_address_nor_by_a_name_that_leads_there(
    rebind: Callable[[int], NameServer], inner: Service
) -> None:
    rebind(0)
    connect_to_public_alone()
    for address in (f"{inner.url}/a.zarr", address_of(inner, "a.zarr")):
        with pytest.raises(SourceError):
            read.open(address)
        client = WebClient([address], shown="a service")  # hosts of a service may be private else
        with pytest.raises(SourceError, match="leads into a private network"):
            client.fetch_json(address)
        with pytest.raises(SourceError, match="leads into a private network"):
            numbers_of(address)
    assert inner.asked == []


@pytest.mark.slow
def test_an_address_that_was_public_when_it_was_handed_in_fails_later(
    tmp_path: Path, inner: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The private IP address stands for the answer of the name server to the reader's process."""
    monkeypatch.setattr(inbox_app, "_is_on_this_machine", lambda _: False)  # from another machine
    monkeypatch.setattr(inbox_module, "check_address", lambda text, **_: text)
    (tmp_path / "served").mkdir()
    with serving_inbox(tmp_path / "served", is_near=False) as server:
        client = InboxClient(server.port)
        address = f"{inner.url}/a.zarr"
        status, content, _ = client.ask("POST", "/items", {"address": address})
        assert status == 201, content
        client.wait(content["id"], "failed")
    assert inner.asked == []


def test_a_build_for_a_stranger_does_not_ask_an_inner_host(
    tmp_path: Path, rebind: Callable[[int], NameServer], inner: Service
) -> None:
    rebind(0)
    address = address_of(inner, "f.ome.tif")
    build = make_inbox_build(
        address, Resolved(address), Choices(title="A"), tmp_path / "out", is_stranger=True
    )
    with patch("stereocell.cli.inbox_build._be_silent"):
        assert build(lambda *_: None) != ""
    assert inner.asked == []

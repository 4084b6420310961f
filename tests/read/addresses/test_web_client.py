"""The client of services against servers that answer badly or redirect elsewhere."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from stereocell.model.errors import SourceError
from stereocell.read.addresses import web_client
from stereocell.read.addresses.resolved import NotThereError
from stereocell.read.addresses.web_client import WebClient
from support.recorded_service import Answer, Service

SECRET = "s3cr3t-t0ken"


def client(service: Service, **options: Any) -> WebClient:
    return WebClient([service.url], shown="the service", **options)


def test_json_is_read(service: Service) -> None:
    service.json("/a", {"b": [1, 2]})
    assert client(service).fetch_json(f"{service.url}/a?q=1") == {"b": [1, 2]}
    assert service.paths == ["/a?q=1"]


def test_an_empty_answer_is_none(service: Service) -> None:
    service.answers["/a"] = Answer(b"", 204)
    assert client(service).fetch_json(f"{service.url}/a") is None


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (Answer(b"<!doctype html><title>Log in</title>"), "found a web page"),
        (Answer(b'{"a": '), "damaged JSON"),
        (Answer(b"\xff\xfe\x00"), "damaged JSON"),
        (Answer(b"[" * 200_000), "damaged JSON"),
        (Answer(b"", 401), "HTTP 401"),
        (Answer(b"", 403), "HTTP 403"),
        (Answer(b"", 404), "HTTP 404"),
        (Answer(b"", 500), "HTTP 500"),
        (Answer(b"", 302), "redirect"),
        (Answer(b"{}", 206), "HTTP 206"),
        (Answer(b"{}", headers={"Content-Encoding": "gzip"}), "compressed bytes"),
    ],
)
def test_a_bad_answer_is_refused_in_one_line(service: Service, answer: Answer, words: str) -> None:
    service.answers["/a"] = answer
    with pytest.raises(SourceError, match=words) as caught:
        client(service).fetch_json(f"{service.url}/a")
    assert "\n" not in str(caught.value)
    assert "expected" in str(caught.value)


def test_a_huge_answer_is_refused_before_it_fills_memory(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(web_client, "ANSWER_BYTES", 1 << 20)
    service.put("/a", b"[" + b"1," * (4 << 20))
    with pytest.raises(SourceError, match="more than 1 MiB"):
        client(service).fetch(f"{service.url}/a", "*/*")


def test_an_answer_that_comes_too_slowly_is_refused(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(web_client, "ANSWER_S", -1.0)
    service.json("/a", {})
    with pytest.raises(SourceError, match="no end within"):
        client(service).fetch_json(f"{service.url}/a")


def test_a_server_that_is_down_is_reported_in_one_line() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        url = f"http://127.0.0.1:{taken.getsockname()[1]}"
    with pytest.raises(SourceError, match="expected a server that responds"):
        WebClient([url], shown="the service").fetch(f"{url}/a", "*/*")


CHUNKED = b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n"


@contextmanager
def sending(sent: bytes) -> Iterator[str]:
    """Answer one request with bytes as they are; yield the address."""
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def answer() -> None:
            other, _ = listening.accept()
            with other:
                other.recv(1000)
                other.sendall(sent)

        thread = Thread(target=answer)
        thread.start()
        yield f"http://127.0.0.1:{listening.getsockname()[1]}"
        thread.join()


@pytest.mark.parametrize(
    "sent",
    [
        b"",
        b"nonsense\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nA: " + b"b" * 99999,
        CHUNKED + b"5\r\n[1, 2\r\n",
        CHUNKED + b"5\r\n[1",
        CHUNKED + b"-5\r\n[1, 2]\r\n0\r\n\r\n",
        CHUNKED + b"zz\r\n[1, 2]\r\n0\r\n\r\n",
    ],
)
def test_a_server_that_does_not_speak_http_is_reported_in_one_line(sent: bytes) -> None:
    with sending(sent) as url, pytest.raises(SourceError, match=r"^the service: "):
        WebClient([url], shown="the service").fetch(f"{url}/a", "*/*")


def test_an_answer_in_chunks_is_read() -> None:
    with sending(CHUNKED + b"3\r\n[1,\r\n3\r\n 2]\r\n0\r\n\r\n") as url:
        assert WebClient([url], shown="the service").fetch_json(f"{url}/a") == [1, 2]


def test_waiting_for_a_silent_server_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(web_client, "SILENCE_S", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        url = f"http://127.0.0.1:{listening.getsockname()[1]}"
        with pytest.raises(SourceError, match="no answer within"):
            WebClient([url], shown="the service").fetch(f"{url}/a", "*/*")


def test_a_redirect_within_the_host_is_followed_with_the_token(service: Service) -> None:
    service.redirect("/a", "/b")
    service.json("/b", 1)
    assert client(service, token=SECRET).fetch_json(f"{service.url}/a") == 1
    assert [one.headers.get("Authorization") for one in service.asked] == [f"Bearer {SECRET}"] * 2


def test_a_redirect_into_the_local_network_is_refused(
    service: Service, other_service: Service
) -> None:
    other_service.json("/b", "the metadata of a cloud")
    service.redirect("/a", f"{other_service.url}/b")
    with pytest.raises(SourceError, match="private network"):
        client(service).fetch(f"{service.url}/a", "*/*")
    assert other_service.asked == []


def test_no_other_host_gets_the_token(service: Service, other_service: Service) -> None:
    other_service.json("/b", 2)
    service.redirect("/a", f"{other_service.url}/b")
    both = WebClient([service.url, other_service.url], shown="both", token=SECRET)
    assert both.fetch_json(f"{service.url}/a") == 2
    assert both.fetch_json(f"{other_service.url}/b") == 2
    assert [one.headers.get("Authorization") for one in other_service.asked] == [None, None]
    assert SECRET not in str(other_service.asked)


@pytest.mark.parametrize("target", ["file:///etc/passwd", "ftp://host/a", "http://u:p@host/a"])
def test_a_redirect_to_another_scheme_is_refused(service: Service, target: str) -> None:
    service.redirect("/a", target)
    with pytest.raises(SourceError, match="expected"):
        client(service).fetch(f"{service.url}/a", "*/*")


def test_endless_redirects_are_refused(service: Service) -> None:
    for step in range(10):
        service.redirect(f"/{step}", f"/{step + 1}")
    service.json("/10", 1)
    with pytest.raises(SourceError, match="redirects"):
        client(service).fetch(f"{service.url}/0", "*/*")
    assert len(service.asked) == 6


def test_a_post_is_sent_once_and_never_redirected(service: Service) -> None:
    service.json("/a", 3)
    assert client(service).fetch_json(f"{service.url}/a", post={"q": "ä"}) == 3
    assert (service.asked[0].method, service.asked[0].body) == ("POST", b'{"q": "\\u00e4"}')
    service.redirect("/b", "/a")
    with pytest.raises(SourceError, match="redirect"):
        client(service).fetch_json(f"{service.url}/b", post={})
    assert len(service.asked) == 2


def test_a_file_is_saved_completely_or_refused(service: Service, tmp_path: Path) -> None:
    service.put("/a", b"x" * 1000)
    assert client(service).save(f"{service.url}/a", tmp_path / "a", limit=1000) == 1000
    assert (tmp_path / "a").read_bytes() == b"x" * 1000
    with pytest.raises(SourceError, match="at most 999 bytes"):
        client(service).save(f"{service.url}/a", tmp_path / "b", limit=999)
    service.answers["/c"] = Answer(b"x" * 1000, length=2000)
    with pytest.raises(SourceError, match=r"cut off|last byte"):
        client(service).save(f"{service.url}/c", tmp_path / "c", limit=5000)
    with pytest.raises(FileExistsError):
        client(service).save(f"{service.url}/a", tmp_path / "a", limit=1000)


def test_absent_files_are_distinguished_from_faults(service: Service) -> None:
    service.put("/a")
    service.answers["/refused"] = Answer(b"", 403)
    service.answers["/broken"] = Answer(b"", 503)
    asking = client(service)
    assert asking.is_there(f"{service.url}/a")
    assert not asking.is_there(f"{service.url}/b")
    assert not asking.is_there(f"{service.url}/refused")  # public buckets answer so
    with pytest.raises(SourceError, match="HTTP 503"):
        asking.is_there(f"{service.url}/broken")
    with pytest.raises(NotThereError):
        asking.fetch(f"{service.url}/b", "*/*")


def test_line_ends_in_an_address_do_not_reach_headers(service: Service) -> None:
    service.json("/a", 1)
    with pytest.raises(SourceError, match="HTTP 404"):
        client(service).fetch(f"{service.url}/a%0d%0aX-Evil: 1\r\nX-More: 2", "*/*")
    assert all("Evil" not in key for one in service.asked for key in one.headers)

"""Answers of several parts are split as RFC 2046 states, wherever their pieces end.

The expected parts are written by Python's own `email` package.
"""

from collections.abc import Iterator
from email.generator import BytesGenerator
from email.mime.application import MIMEApplication
from email.mime.multipart import MIMEMultipart
from email.policy import HTTP
from io import BytesIO

import numpy as np
import pytest

from stereocell.model.errors import SourceError
from stereocell.read.addresses.multipart import boundary_of, split_parts


def parts_of(body: bytes, boundary: bytes, size: int) -> list[bytes]:
    blocks = (body[at : at + size] for at in range(0, len(body), size))
    return joined(split_parts(blocks, boundary, "here"))


def joined(pieces: Iterator[bytes | None]) -> list[bytes]:
    parts, part = [], b""
    for piece in pieces:
        if piece is None:
            parts.append(part)
            part = b""
        else:
            part += piece
    assert part == b""
    return parts


PARTS = [
    np.random.default_rng(0).bytes(5000),
    b"",
    b"\r\n",
    b"--edge\r\n--ed",  # nearly a boundary
    b"ends with a line\r\n",
]


@pytest.mark.parametrize("size", [1, 2, 3, 7, 64, 5001, 1 << 20])
def test_parts_do_not_depend_on_the_pieces_of_the_answer(size: int) -> None:
    heads = [b"\r\n--edge\r\nContent-Type: application/dicom\r\n\r\n" + part for part in PARTS]
    body = b"a preamble" + b"".join(heads) + b"\r\n--edge--\r\nan epilogue"
    assert parts_of(body, b"edge", size) == PARTS


def test_parts_without_headers_and_spaces_after_the_boundary_are_read() -> None:
    body = b"--edge  \r\n\r\none\r\n--edge\r\nA: b\r\nC: d\r\n\r\ntwo\r\n--edge--"
    assert parts_of(body, b"edge", 5) == [b"one", b"two"]


def test_parts_of_another_program_are_read() -> None:
    message = MIMEMultipart("related", boundary="a b=c", policy=HTTP)
    for part in (b"first", b"second part"):
        message.attach(MIMEApplication(part, "dicom", lambda m: None, policy=HTTP))
    for one, part in zip(message.get_payload(), (b"first", b"second part"), strict=True):
        one.set_payload(part.decode())
    out = BytesIO()
    BytesGenerator(out, policy=HTTP).flatten(message)
    body = out.getvalue().partition(b"\r\n\r\n")[2]
    boundary = boundary_of(str(message["Content-Type"]), "here")
    assert parts_of(body, boundary, 10) == [b"first", b"second part"]


@pytest.mark.parametrize("kept", range(0, 83, 6))
def test_a_truncated_answer_is_refused(kept: int) -> None:
    body = b"--edge\r\nContent-Type: application/dicom\r\n\r\n" + b"x" * 30 + b"\r\n--edge--"
    assert kept < len(body)
    with pytest.raises(SourceError, match="ends within a part"):
        parts_of(body[:kept], b"edge", 16)


def test_an_endless_header_is_refused() -> None:
    body = b"--edge\r\nA: " + b"b" * 200_000
    with pytest.raises(SourceError, match="endless header"):
        parts_of(body, b"edge", 1000)


@pytest.mark.parametrize(
    "content_type",
    [
        'multipart/related; type="application/dicom"',
        "multipart/related; boundary=",
        'multipart/related; boundary="ä"',
        f"multipart/related; boundary={'x' * 71}",
    ],
)
def test_answers_of_parts_without_a_boundary_are_refused(content_type: str) -> None:
    with pytest.raises(SourceError, match="boundary"):
        boundary_of(content_type, "here")


@pytest.mark.parametrize("content_type", ["", "text/html", "application/dicom", "multipart/mixed"])
def test_an_answer_of_another_content_type_is_refused(content_type: str) -> None:
    with pytest.raises(SourceError, match="multipart/related"):
        boundary_of(content_type, "here")

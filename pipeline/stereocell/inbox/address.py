"""Check addresses that people paste: http(s) or s3, and from other machines only public hosts.

A person at this machine may name any http(s) or s3 address that `build` takes. A person at another
machine acts through this one, which may reach more than they do: hosts of its own network, and data
that its credentials open.
"""

import json
import os
import re

from stereocell.inbox.refused import RefusedError
from stereocell.model.errors import StereoCellError
from stereocell.read.addresses.dicomweb import TOKEN
from stereocell.storage.public_hosts import (
    connect_to_public_alone,
    public_numbers_of,
    split_address,
)

_BUCKET = re.compile(r"[a-z0-9][a-z0-9.-]{1,61}[a-z0-9]")
_IP = re.compile(r"[0-9.]+")
_EXPECTED = "expected an image's address with https://, http:// or s3://"


def check_address(address: str, *, is_local: bool) -> str:
    """Return an address that may be read. Raises RefusedError.

    is_local  whether the person is at this machine and may name hosts of its private network
    """
    text = address.strip()
    if not text.isprintable() or not text.isascii() or " " in text or "\\" in text:
        raise RefusedError(400, f"address: found spaces or special characters, {_EXPECTED}")
    scheme, mark, rest = text.partition("://")
    scheme = scheme.lower()
    if not mark or scheme not in ("http", "https", "s3"):
        raise RefusedError(400, f"address: found another scheme, {_EXPECTED}")
    text = f"{scheme}://{rest}"
    if scheme == "s3":
        _check_bucket(rest)
        return text
    try:
        split_address(text)
        if not is_local:
            public_numbers_of(text)
    except StereoCellError as error:
        raise RefusedError(400, _line_of(error, is_local=is_local)) from None
    return text


def read_as_stranger() -> None:
    """Limit this process, and those that it starts, to data that a stranger can reach.

    They get no credentials of this machine, and connect to public hosts only.
    """
    import fsspec

    connect_to_public_alone()
    os.environ.pop(TOKEN, None)
    for name in [name for name in os.environ if name.startswith(("AWS_", "FSSPEC_"))]:
        del os.environ[name]
    os.environ["FSSPEC_S3"] = json.dumps({"anon": True})
    fsspec.config.conf.clear()
    fsspec.config.conf["s3"] = {"anon": True}


def _check_bucket(rest: str) -> None:
    bucket, _, key = rest.partition("/")
    is_name = _BUCKET.fullmatch(bucket) and ".." not in bucket and not _IP.fullmatch(bucket)
    if not is_name or not key.strip("/"):
        raise RefusedError(400, "address: found no bucket and key, expected s3://bucket/image")
    if "?" in rest or "#" in rest or ".." in key.split("/"):
        raise RefusedError(400, "address: found ?, # or .. in a key, expected s3://bucket/image")


def _line_of(error: StereoCellError, *, is_local: bool) -> str:
    if is_local or "private network" not in str(error):
        return f"address: found no host that can be reached, {_EXPECTED}"
    return "address: found a host in a private network, expected a public one"

"""Serving on the LAN: this machine's addresses, a certificate, a QR code to scan.

WebXR and device orientation need a secure context, hence TLS. trustme makes the certificate at
start, for the machine's addresses, and signs it by an authority whose key is discarded at once;
neither is stored. A phone doesn't know the authority and warns: the person compares the
fingerprint.
"""

import hashlib
import io
import socket
import ssl
from collections.abc import Sequence

import idna

from stereocell.model.errors import StereoCellError


def find_addresses() -> list[str]:
    """Return this machine's IPv4 addresses on the LAN, the one of the default route first.

    Raises StereoCellError where there is none.
    """
    found: list[str] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # chooses a route; UDP sends nothing here
            found.append(probe.getsockname()[0])
        except OSError:
            pass
    try:
        for *_, address in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET):
            found.append(str(address[0]))
    except OSError:
        pass
    addresses = [a for a in dict.fromkeys(found) if not a.startswith("127.") and a != "0.0.0.0"]
    if not addresses:
        raise StereoCellError("--lan: this machine has no address on a network, expected one")
    return addresses


def find_names(addresses: Sequence[str]) -> list[str]:
    """Return the names that the server answers to, in lower case."""
    host = socket.gethostname().lower()
    return list(dict.fromkeys([*addresses, host, f"{host}.local", "localhost", "127.0.0.1"]))


def _can_be_certified(name: str) -> bool:
    """Return whether a certificate can hold the name: not with an underscore, as Docker's hosts."""
    try:
        return bool(idna.encode(name))
    except idna.IDNAError:
        return False


def make_certificate(names: Sequence[str]) -> tuple[ssl.SSLContext, str]:
    """Return a server's TLS context for these names, and its certificate's SHA-256 fingerprint.

    trustme passes the key to OpenSSL in a file of the temporary folder, which it removes at once.
    """
    names = [name for name in names if _can_be_certified(name)]
    import trustme  # only here: most servers serve this machine alone, and the import is slow

    leaf = trustme.CA(organization_name="StereoCell", organization_unit_name="this run").issue_cert(
        *names, organization_name="StereoCell", organization_unit_name="this run"
    )
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    leaf.configure_cert(context)
    der = ssl.PEM_cert_to_DER_cert(leaf.cert_chain_pems[0].bytes().decode())
    digest = hashlib.sha256(der).hexdigest().upper()
    return context, ":".join(digest[i : i + 2] for i in range(0, len(digest), 2))


def draw_qr(address: str, *, encoding: str = "utf-8") -> str:
    """Return a QR code for a terminal, of half blocks; where its encoding lacks them, of spaces
    with escape codes for the background."""
    import segno

    code = segno.make(address, error="l", micro=False)
    text = io.StringIO()
    code.terminal(text, border=2, compact=True)
    try:
        text.getvalue().encode(encoding)
    except UnicodeEncodeError:
        text = io.StringIO()
        code.terminal(text, border=2)
    return text.getvalue()


def explain(address: str, fingerprint: str, code: str) -> str:
    """Return the text for the person at the terminal. Only the code contains the token."""
    return (
        f"{code}\n"
        f"Scan this code with a phone in the same network: it opens {address} with a token\n"
        "that lets in one device, once.\n"
        "The phone warns that it does not know the certificate: this program made it just now,\n"
        "for this run, so nobody else has vouched for it. It encrypts all the same, and browsers\n"
        "give stereo (WebXR) and head tracking to encrypted pages only. Go on (Advanced, Proceed;\n"
        "on an iPhone: Show Details, visit this website) if the certificate that the phone shows\n"
        f"has this SHA-256 fingerprint:\n{fingerprint}\n"
        "If it has another, somebody is in between: go back."
    )

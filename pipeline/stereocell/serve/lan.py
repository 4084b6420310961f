"""Serving on the LAN: this machine's addresses, a certificate, a QR code to scan.

WebXR and device orientation need a secure context, hence TLS. At start, trustme makes a certificate
for the machine's addresses and signs it by an authority whose key is discarded at once. Neither is
stored. A phone doesn't know the authority and shows a warning. The person then compares the
certificate's fingerprint with the one in the terminal.
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

    Raises StereoCellError if there is none.
    """
    found: list[str] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # this only chooses a route: UDP sends nothing yet
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
        raise StereoCellError(
            "--lan: this machine has no address on a network, expected one: connect it, or "
            "omit --lan"
        )
    return addresses


def find_names(addresses: Sequence[str]) -> list[str]:
    """Return the names that the server answers to, in lower case."""
    host = socket.gethostname().lower()
    return list(dict.fromkeys([*addresses, host, f"{host}.local", "localhost", "127.0.0.1"]))


def _can_be_certified(name: str) -> bool:
    """Return whether a certificate can hold the name. Names of Docker's hosts with `_` can't be."""
    try:
        return bool(idna.encode(name))
    except idna.IDNAError:
        return False


def make_certificate(names: Sequence[str]) -> tuple[ssl.SSLContext, str]:
    """Return a server's TLS context for these names, and its certificate's SHA-256 fingerprint.

    trustme passes the key to OpenSSL in a file of the temporary folder, which it removes at once.
    """
    names = [name for name in names if _can_be_certified(name)]
    import trustme  # imported here, since it is slow and most servers serve this machine only

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
    """Return a QR code for a terminal, drawn with half blocks.

    If the terminal's encoding lacks half blocks, the code consists of spaces on backgrounds that
    escape codes set.
    """
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
    """Return the text for the person at the terminal. The token is in the code, not in the text."""
    return (
        f"{code}\n"
        f"Scan this code with a phone in the same network: it opens {address} with a token\n"
        "that lets in one device, once.\n"
        "The phone warns that it does not know the certificate: this program made it just now,\n"
        "for this run, and no authority has signed it. The connection is encrypted all the same,\n"
        "and browsers allow stereo (WebXR) and head tracking on encrypted pages only.\n"
        "Continue (Advanced, Proceed; on an iPhone: Show Details, visit this website) if the\n"
        f"certificate that the phone shows has this SHA-256 fingerprint:\n{fingerprint}\n"
        "If the fingerprint differs, somebody intercepts the connection: go back."
    )

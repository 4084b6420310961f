"""Find texts that are not UTF-8, as arguments and file names of another encoding become."""


def escaped_bytes(text: str) -> str:
    """Return a text that is not UTF-8, with its other bytes escaped; empty: it is UTF-8.

    >>> escaped_bytes("caf\\udce9")
    'caf\\\\xe9'
    """
    try:
        text.encode()
    except UnicodeEncodeError:
        try:
            return text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
        except UnicodeEncodeError:  # no bytes become such a text
            return text.encode("utf-8", "backslashreplace").decode()
    return ""

"""Find texts that are not UTF-8, such as arguments and file names in another encoding."""


def escaped_bytes(text: str) -> str:
    """Return a text with its bytes that are not UTF-8 escaped; empty: all of it is UTF-8.

    >>> escaped_bytes("caf\\udce9")
    'caf\\\\xe9'
    """
    try:
        text.encode()
    except UnicodeEncodeError:
        try:
            return text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
        except UnicodeEncodeError:  # the text has surrogates that stand for no byte
            return text.encode("utf-8", "backslashreplace").decode()
    return ""

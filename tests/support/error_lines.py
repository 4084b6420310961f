"""The one line by which a command names a fault."""

import pytest


def error_line(capfd: pytest.CaptureFixture[str]) -> str:
    """Return the line that was printed; fail where there are several, or a traceback."""
    printed = capfd.readouterr().err
    assert "Traceback" not in printed
    (line,) = [line for line in printed.splitlines() if line.startswith("stereocell: ")]
    return line

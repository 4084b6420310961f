"""A build but for its report, which takes longest: for tests that look at no report.

`python -m support.validators INPUT OUT [INPUT OUT ...]` does it in one process.
"""

import sys
from pathlib import Path

from stereocell.cli.__main__ import main


def make_assets(
    source: Path | str, out: Path | str, grid: str, *flags: str, plan: tuple[str, ...] = ()
) -> int:
    """Plan, units, stage and bundle; `flags` say who works. Return the first code that is not 0."""
    code = main(["plan", str(source), "-o", str(out), "--grid", grid, *plan])
    for phase in ("units", "stage", "bundle"):
        code = code or main([phase, str(out), *flags])
    return code


if __name__ == "__main__":
    for source, out in zip(sys.argv[1::2], sys.argv[2::2], strict=True):
        if code := make_assets(source, out, "1x1", "--workers", "0"):
            sys.exit(code)

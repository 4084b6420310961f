"""A build but for its report, which takes longest: for tests that look at no report."""

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

"""A build without its report, the longest phase, for tests that do not need the report."""

from pathlib import Path

from stereocell.cli.__main__ import main


def make_assets(
    source: Path | str, out: Path | str, grid: str, *flags: str, plan: tuple[str, ...] = ()
) -> int:
    """Run plan, units, stage and bundle; return the first exit code that is not 0, or 0.

    flags  where units are built, such as the number of workers
    """
    code = main(["plan", str(source), "-o", str(out), "--grid", grid, *plan])
    for phase in ("units", "stage", "bundle"):
        code = code or main([phase, str(out), *flags])
    return code

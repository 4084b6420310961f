"""The table of the folders that each command reads and writes: for --force and for wrong folders.

A test checks that every command has a row, and runs each writing command on a folder that holds
other files.
"""

from dataclasses import dataclass
from pathlib import Path

from stereocell.storage.kinds import Kind

_BUILD = frozenset({Kind.BUILD})
_BUNDLE = frozenset({Kind.BUILD, Kind.BUNDLE, Kind.SITE})


@dataclass(frozen=True, slots=True)
class Places:
    """The places of one command.

    reads   kinds of folders that OUT may be; empty: OUT is not read
    writes  the argument that names the place of the result; empty: nothing is written
    """

    reads: frozenset[Kind] = frozenset()
    writes: str = ""


PLACES = {
    "build": Places(writes="out"),
    "plan": Places(writes="out"),
    "iso": Places(writes="out"),
    "slices": Places(writes="out"),
    "units": Places(_BUILD, writes="out"),
    "stage": Places(_BUILD, writes="out"),
    "bundle": Places(_BUILD, writes="out"),
    "report": Places(_BUILD, writes="out"),
    "tissue": Places(_BUILD, writes="out"),
    "export": Places(_BUILD, writes="file"),
    "publish": Places(_BUNDLE, writes="target"),
    "check": Places(_BUNDLE),
    "view": Places(_BUNDLE),
    "serve": Places(_BUNDLE),
    "sample": Places(writes="out"),
    "doctor": Places(),
    "settings": Places(),
}
FORCE = (
    "replace all that lies where the result goes; without it, only StereoCell's own results of the "
    "same specimen are replaced"
)


def require_place(command: str, out: Path, source: str = "") -> None:
    """Raise OutputError where OUT is no folder that a command can read or write.

    Imports are lazy, so that --help is quick.
    """
    places = PLACES[command]
    if places.reads:
        from stereocell.storage.contents import require_kind

        require_kind(out, places.reads)
    elif command in ("build", "plan"):
        from stereocell.building.out_folder import require_build_or_nothing

        require_build_or_nothing(out, source)

"""Check the files that `stereocell publish` adds to a bundle: compressed copies, and their list."""

import json
from collections.abc import Mapping
from pathlib import Path

from stereocell.storage.contents import PUBLISHED
from stereocell.storage.file_list import MISSING, measure

_AGAIN = "run `stereocell publish OUT TARGET` again"


def find_site_faults(found: Mapping[str, Path]) -> list[str]:
    """Compare a published page's files with the list of published files; return the faults.

    found  all files of the page by relative path; the web host's own files are not in the list
    """
    try:
        listed = dict(json.loads(found[PUBLISHED].read_bytes())["files"])
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return [f"{PUBLISHED}: found no list of published files, so it is damaged: {_AGAIN}"]
    faults = []
    for path, entry in listed.items():
        if entry is None:
            faults.append(f"{path}: publishing did not finish: {_AGAIN}")
        elif path not in found:
            faults.append(f"{path}: {MISSING}: {_AGAIN}")
        elif measure(found[path]) != entry:
            faults.append(f"{path}: its size or hash differs from {PUBLISHED}: {_AGAIN}")
    return faults

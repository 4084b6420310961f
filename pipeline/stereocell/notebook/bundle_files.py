"""Give the page in a notebook the files of a bundle, and no others.

The bundle's own list names its files. A path that is not in the list is not found, and so can't
lead out of the folder by `..`. A listed file that is a link to a place outside is not found either.
"""

from pathlib import Path

from stereocell.bundle.blob_page import find_page
from stereocell.bundle.manifest import FILES, MANIFEST, REMEDY, read_manifest
from stereocell.serve.static_files import parse_range
from stereocell.storage.file_list import read_list

_LIGHTS = ("environments/sky.hdr", "environments/studio.hdr")  # environment maps of the viewer
_WHOLE, _PART, _MISSING, _UNSATISFIABLE = 200, 206, 404, 416


class NotebookBundle:
    """A bundle that a notebook shows.

    name      name of the specimen
    channels  IDs of the channels
    ids       ID of each channel, by its ID and by its name
    """

    def __init__(self, folder: Path) -> None:
        """Raises OutputError if there is no bundle, or its list is damaged."""
        self._root = folder.resolve()
        manifest = read_manifest(self._root)
        listed = read_list(self._root / FILES, REMEDY)
        self._names = {MANIFEST, *listed}
        self.name = str(manifest["specimen"]["name"])
        about = [(str(one["id"]), str(one["name"])) for one in manifest["channels"]]
        self.channels = [id_ for id_, _ in about]
        self.ids = {**{name: id_ for id_, name in about}, **{id_: id_ for id_, _ in about}}

    def answer(self, path: object, *, header: object = None) -> tuple[int, bytes]:
        """Return an HTTP status and the bytes of a file, or of the part in a Range header.

        The page may send any values. This method answers all of them without raising.
        """
        place = self._find(path) if isinstance(path, str) else None
        try:
            content = b"" if place is None else place.read_bytes()
        except OSError:  # the file was removed meanwhile
            place = None
        if place is None:
            return _MISSING, b""
        asked = parse_range(header, len(content)) if isinstance(header, str) else None
        if asked is None:
            return _WHOLE, content
        if not asked:
            return _UNSATISFIABLE, b""
        return _PART, content[asked.start : asked.stop]

    def _find(self, path: str) -> Path | None:
        if path in self._names:
            root = self._root
        elif path in _LIGHTS:
            root = find_page()
        else:
            return None
        place = (root / path).resolve()
        return place if place.is_relative_to(root) and place.is_file() else None

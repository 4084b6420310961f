"""Full-resolution tiles of an item for a camera nearby, read from the upload as a build does."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stereocell.inbox.choices import Choices
from stereocell.inbox.item import Item
from stereocell.inbox.lines import line_of
from stereocell.inbox.reader import Source
from stereocell.inbox.refused import RefusedError
from stereocell.isosurface.holder import Holder
from stereocell.model.errors import SourceError

if TYPE_CHECKING:
    from stereocell.inbox.inbox import Inbox


@dataclass(frozen=True, slots=True)
class ItemTiles:
    """Reads tiles in a process that does not also read uploads, so that a viewer need not wait.

    source, choices  the ones of the view that is shown; the item may have newer choices
    """

    inbox: "Inbox"
    item: Item
    source: Source
    choices: Choices

    def read(
        self, tile_id: str, channel_id: str, window: tuple[float, float], holder: Holder | None
    ) -> NDArray[np.uint8]:
        """Return a tile's voxels; see `FineTiles.read`. Raises SourceError, free of file names."""
        item, arguments = self.item, (tile_id, channel_id, window, holder)
        try:
            with item.reading:
                if item.upload is None:
                    raise RefusedError(410, "the upload was deleted")
                found: NDArray[np.uint8] = self.inbox.tile_reader.run(
                    item, "fine_tile", self.source, self.choices, *arguments
                )
                return found
        except Exception as error:  # a stranger's files may cause any error in a reader
            raise SourceError(line_of(item, error)) from None

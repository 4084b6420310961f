"""Tiles of an item that someone looks at from near, read from its upload as a build reads them."""

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
    """Reads them by a reader that no other item's upload keeps busy.

    source, choices  those of the view that is looked at: an item may have newer choices
    """

    inbox: "Inbox"
    item: Item
    source: Source
    choices: Choices

    def read(
        self, tile_id: str, channel_id: str, window: tuple[float, float], holder: Holder | None
    ) -> NDArray[np.uint8]:
        """Return a tile's voxels; see `FineTiles.read`. Raises SourceError, without a name."""
        item, asked = self.item, (tile_id, channel_id, window, holder)
        try:
            with item.reading:
                if item.upload is None:
                    raise RefusedError(410, "its upload is gone")
                found: NDArray[np.uint8] = self.inbox.tile_reader.run(
                    item, "fine_tile", self.source, self.choices, *asked
                )
                return found
        except Exception as error:  # whatever a reader meets in a stranger's files
            raise SourceError(line_of(item, error)) from None

"""Prepare a source for display before it is built: its plan, coarse voxels and a first view."""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from stereocell.live.coarse_channel import CoarseChannel, OnRead
from stereocell.live.coarse_tiles import Sizes
from stereocell.live.first_appearance import load_kernels
from stereocell.live.first_view import read_channels, write_first_view
from stereocell.planning.input_files import as_asked
from stereocell.planning.plan import Plan
from stereocell.planning.settings import Settings
from stereocell.planning.settle import settle
from stereocell.read import Dataset
from stereocell.steps.open_source import open_source


@dataclass(slots=True)
class FirstLook:
    """A source with its settled plan. The voxels are read once, when first needed."""

    plan: Plan
    dataset: Dataset
    _read: Mapping[str, CoarseChannel] | None = field(default=None)

    @classmethod
    def at(
        cls, source: str, settings: Settings, choice: Sequence[str], *, title: str = ""
    ) -> "FirstLook":
        """Settle the plan of a source. The arguments and errors are those of `settle`."""
        # The kernels load in a thread while reading and hashing leave the interpreter idle.
        loading = threading.Thread(target=load_kernels, daemon=True)
        loading.start()
        plan = settle(source, settings, choice, title=title)
        # An import of USD, which follows, would wait for ever for a thread that loads a library.
        loading.join()
        return cls(plan, open_source(as_asked(plan.source, plan.settings.plan)))

    def read(self, on_read: OnRead = lambda share: None) -> Mapping[str, CoarseChannel]:
        """Return the coarse voxels of the channels; see `read_channels`. Raises SourceError."""
        if self._read is None:
            self._read = read_channels(self.plan, self.dataset, on_read)
        return self._read

    def write(self, bundle: Path, sizes: Sizes | None = None) -> None:
        """Write the first view into a folder; see `first_view.write_first_view`."""
        write_first_view(self.plan, self.read(), bundle, sizes)

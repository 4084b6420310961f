"""Read a stranger's files in a process that may die, with the product's own readers.

If a reader crashes, hangs or takes too much memory, that process ends, and the item's line reports
it. Otherwise the process stays for a while, so that other choices or a view need not read again.
"""

import os
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell import read
from stereocell.inbox.address import read_as_stranger
from stereocell.inbox.arrange import arrange
from stereocell.inbox.choices import BRIGHT, DARK, Choices
from stereocell.inbox.limits import InboxLimits
from stereocell.inbox.middle_slices import ShownChannel, hex_of, write_middle_slices
from stereocell.inbox.refused import RefusedError
from stereocell.isosurface.holder import Holder
from stereocell.live.coarse_channel import CoarseChannel
from stereocell.live.coarse_tiles import Sizes
from stereocell.live.fine_tiles import FineTiles
from stereocell.live.first_appearance import first_appearance
from stereocell.live.first_look import FirstLook
from stereocell.model.errors import StereoCellError
from stereocell.planning.plan import Plan
from stereocell.planning.preset_choice import load_for
from stereocell.planning.settings import NO_PRESET, preset_names
from stereocell.preview.views import views_of
from stereocell.read.addresses.resolve import remember, resolve
from stereocell.read.addresses.resolved import Resolved
from stereocell.read.known_formats import format_of
from stereocell.read.series import SeveralDatasetsError

FETCHED = "fetched"  # folder, in an upload's folder, for files that are fetched from an address
_MODALITIES = {"PT": "PET", "NM": "SPECT"}  # common names of DICOM's codes
_VOXEL_BYTES = 4  # bytes on the disk, roughly, that a build takes for each voxel of a channel
_PRESET = re.compile(r"preset ([\w-]+):")
_SERIES = re.compile(r"--series (\d+)")
_LISTED = re.compile(r"\s*(\d+)\s+(.*)")


@dataclass(frozen=True, slots=True)
class Source:
    """A source in the inbox.

    place        the file or folder of an upload, or an address
    found        the place that a web service named, if an earlier process asked it; else empty
    found_notes  notes on how that place was found
    """

    place: str
    found: str = ""
    found_notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ToBuild:
    """The inputs of an item's build; see `builds.MakeBuild`."""

    source: str
    found: Resolved
    choices: Choices


@dataclass(frozen=True, slots=True)
class FirstView:
    """The plan, voxels and choices from which the first view of an item was made.

    read   coarse voxels by channel; see `first_view.read_channels`
    sizes  see `FineTiles.sizes`
    """

    plan: Plan
    read: Mapping[str, CoarseChannel]
    sizes: Sizes
    to_build: ToBuild


class Reader:
    """Reads one item. It lives in a process of its own; see `storage.child_process`."""

    def __init__(self) -> None:
        self._upload = Path()
        self._look: FirstLook | None = None
        self._choices = Choices()  # the choices with which the plan was settled
        self._series: dict[str, list[dict[str, str]]] = {}
        self._datasets: SeveralDatasetsError | None = None

    def begin(self, upload: str, is_stranger: bool) -> None:
        """Begin to read an item. The process can't change to another item later.

        upload       the item's folder of the upload, the only one that may hold a person's identity
        is_stranger  use no credentials of this machine, and only public hosts
        """
        self._upload = Path(upload)
        fetched = self._upload / FETCHED
        fetched.mkdir(exist_ok=True)
        os.environ["TMPDIR"] = tempfile.tempdir = str(fetched)
        if is_stranger:
            read_as_stranger()

    def arrange(self, limits: InboxLimits) -> str:
        """Arrange the upload; return the file or folder to open. See `arrange.arrange`."""
        return arrange(str(self._upload), limits)

    def understand(self, source: Source, choices: Choices, folder: str) -> dict[str, Any]:
        """Return the facts found in a source, and write its middle slices into a folder."""
        choice = self._settle(source, choices)
        assert self._look is not None
        plan, dataset = self._look.plan, self._look.dataset
        coarse = self._look.read()
        shared, first = plan.shared_volumes, replace(plan, labels=()).shown_at_first
        shown, channels = [], []
        for channel in plan.channels:
            appearance, _ = first_appearance(plan, channel, coarse[channel.voxels_id])
            channels.append(
                {
                    "id": channel.id,
                    "name": channel.name,
                    "color": hex_of(appearance.color),
                    "has_surface": appearance.level is not None,
                    "level": _rounded(appearance.iso_value),
                    "unit": "HU" if plan.modality == "CT" and plan.is_hounsfield else "",
                }
            )
            if channel.id not in shared and channel.id in first:
                shown.append(ShownChannel(coarse[channel.voxels_id], appearance))
        views = views_of(plan.placement, is_neurological=plan.settings.plan.neurological)
        size_um = [n * step for n, step in zip(plan.region.shape, plan.spacing_um, strict=True)][
            ::-1
        ]
        voxels = plan.region.shape[0] * plan.region.shape[1] * plan.region.shape[2]
        chosen = list(dict.fromkeys(str(channel.index) for channel in plan.channels))
        series = self._list_series(source)
        return {
            "format": format_of(plan.source).short_title,
            "title": plan.name,
            "modality": plan.modality,
            "size_voxels": list(plan.region.shape[::-1]),
            "spacing_um": list(plan.spacing_um[::-1]),
            "size_um": size_um,
            "size_text": words_of_size(size_um),
            "tiles": len(plan.tiles),
            "bytes_estimate": voxels * len(chosen) * _VOXEL_BYTES,
            "notes": list(plan.notes),
            "channels": channels,
            "slices": write_middle_slices(shown, views, plan.spacing_um, Path(folder)),
            "choices": {
                "preset": {
                    "value": choices.preset or _preset_in(choice),
                    "options": [*preset_names(), NO_PRESET],
                },
                "channels": {
                    "value": chosen,
                    "options": [
                        {"id": str(i), "name": one.name} for i, one in enumerate(dataset.channels)
                    ],
                },
                "series": {"value": self._chosen_series(choices), "options": series}
                if len(series) > 1
                else None,
                "background": {
                    "value": BRIGHT if plan.settings.plan.dark else DARK,
                    "options": [DARK, BRIGHT],
                }
                if not dataset.modality
                else None,
                "spacing_um": {"value": list(plan.spacing_um[::-1])},
            },
        }

    def first_view(self, source: Source, choices: Choices, bundle: str | None) -> FirstView:
        """Write the first view of a source; return the inputs from which it was made.

        bundle  the folder of the view; None if the view is already written
        """
        look = self._settled(source, choices)
        sizes = FineTiles(look.plan, look.dataset).sizes()
        if bundle is not None:
            look.write(Path(bundle), sizes)
        place, chosen = self._place_of(source, choices)
        found = resolve(place) if place == source.place else Resolved(place)
        return FirstView(look.plan, look.read(), sizes, ToBuild(place, found, chosen))

    def fine_tile(
        self,
        source: Source,
        choices: Choices,
        tile: str,
        channel: str,
        window: tuple[float, float],
        holder: Holder | None,
    ) -> NDArray[np.uint8]:
        """Return a tile's voxels; see `FineTiles.read`."""
        look = self._settled(source, choices)
        return FineTiles(look.plan, look.dataset).read(tile, channel, window, holder)

    def _settled(self, source: Source, choices: Choices) -> FirstLook:
        """Return the source with its settled plan; settle it again if the choices differ."""
        # A title changes nothing about the reading.
        if self._look is None or replace(choices, title=self._choices.title) != self._choices:
            self._settle(source, choices)
        assert self._look is not None
        return self._look

    def _settle(self, source: Source, choices: Choices) -> tuple[str, ...]:
        """Make the plan; return the notes on the choice of its preset."""
        self._look = None
        if source.found:
            remember(source.place, Resolved(source.found, source.found_notes))
        place, chosen = self._place_of(source, choices)
        flags = {"plan": chosen.settings()}
        settings, choice = load_for(place, choices.preset or None, None, flags=flags)
        look = FirstLook.at(place, settings, choice)
        look.plan = replace(look.plan, name=choices.title or title_of(look.plan))
        self._look, self._choices = look, choices
        return choice

    def _place_of(self, source: Source, choices: Choices) -> tuple[str, Choices]:
        """Return the place that is read, and the choices for it.

        If a file contains several datasets, the choice of a series selects one of them. Raises
        RefusedError if there is no such dataset.
        """
        place = resolve(source.place).source
        if self._datasets is None and format_of(place).has_parts:
            try:
                read.open(place)
            except SeveralDatasetsError as error:
                self._datasets = error
            except StereoCellError:  # making the plan opens the place again and reports the error
                pass
        if self._datasets is None:
            return source.place, choices
        count = len(self._datasets.places)
        index = int(choices.series) - 1 if choices.series else self._datasets.likely
        if index not in range(count):
            raise RefusedError(422, f"series: found {index + 1}, expected 1 to {count}")
        return self._datasets.places[index], replace(choices, series="")

    def _chosen_series(self, choices: Choices) -> str:
        assert self._look is not None
        if choices.series:
            return choices.series
        if self._datasets is not None:
            return str(self._datasets.likely + 1)
        return _series_in(self._look.plan)

    def _list_series(self, source: Source) -> list[dict[str, str]]:
        if self._datasets is not None:
            labels = enumerate(self._datasets.labels, start=1)
            return [{"id": str(number), "text": label} for number, label in labels]
        place = resolve(source.place).source
        if place not in self._series:
            has_some = format_of(place).list_series is not None
            lines = read.list_series(place) if has_some else ()
            found = filter(None, map(_LISTED.fullmatch, lines))
            self._series[place] = [{"id": one[1], "text": one[2]} for one in found]
        return self._series[place]


def title_of(plan: Plan) -> str:
    """Return a title from the modality or the format, without any name or tag of the files."""
    if plan.modality:
        return f"{_MODALITIES.get(plan.modality, plan.modality)} volume"
    return f"{format_of(plan.source).short_title} volume"


def words_of_size(size_um: list[float]) -> str:
    """Return the edges of a box as text.

    >>> words_of_size([182000.0, 201000.0, 150000.0])
    '18.2 x 20.1 x 15.0 cm'
    """
    # name of the unit, its length in um, and the longest edge in um from which it is used
    units = (("cm", 1e4, 5e4), ("mm", 1e3, 1e3), ("um", 1.0, 0.0))
    name, unit, _ = next(one for one in units if max(size_um) >= one[2])
    return " x ".join(f"{edge / unit:.1f}" for edge in size_um) + f" {name}"


def _preset_in(notes: tuple[str, ...]) -> str:
    found = next(filter(None, map(_PRESET.match, notes)), None)
    return found[1] if found else NO_PRESET


def _series_in(plan: Plan) -> str:
    found = next(filter(None, map(_SERIES.search, plan.notes)), None)
    return found[1] if found else "1"


def _rounded(level: float | None) -> float | None:
    return None if level is None else float(f"{level:.6g}")

"""The step that learns the tissue classes of a channel, or applies a network to it."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stereocell.engine.step import Step
from stereocell.engine.step_record import libraries_of
from stereocell.model.errors import OutputError
from stereocell.model.tiling import Box
from stereocell.model.version import GENERATOR
from stereocell.steps.open_source import Voxels, open_source
from stereocell.steps.tissue_files import (
    TISSUE_FOLDER,
    TissueClass,
    TissueClasses,
    TissueFolder,
    read_record,
)
from stereocell.tissue.classify import TissueOptions, learn_tissue
from stereocell.tissue.head_classes import HEAD
from stereocell.tissue.onnx_classifier import Network, apply_network


@dataclass(frozen=True, slots=True)
class Learned:
    """The classes that were found.

    probabilities  float32 (n, z, y, x), 0..1
    intensities    mean of each class after bias correction; None for the classes of a network
    names          names of the classes
    bic            Bayesian information criterion by number of classes; empty for a network
    """

    probabilities: NDArray[np.float32]
    intensities: tuple[float | None, ...]
    names: tuple[str, ...]
    bic: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class LearnTissue(Step[TissueClasses]):
    """Learn the classes of a channel in the planned region.

    The result lies in OUT/tissue, which users know, so its name is not the key. The record holds
    the key instead.

    The command runs this step in its own process (building/tissue.py). The network's child process
    belongs to it, and the classes are compared with the plan before they replace earlier ones.

    channel  name of the channel, for the record
    method   options for learning the classes, or the network that knows them. A network counts in
             the key by its digest
    palette  colours (linear RGB) of classes without a colour of their own, in this order
    """

    VERSION: ClassVar[int] = 1
    FORM: ClassVar[TissueFolder] = TISSUE_FOLDER

    voxels: Voxels
    region: Box
    channel: str
    method: TissueOptions | Network
    palette: tuple[tuple[float, float, float], ...]

    def is_whole(self, place: Path) -> bool:
        """Return whether the folder holds the result of this step, undamaged."""
        try:
            is_own = read_record(place)["key"] == self.key
        except OutputError:
            return False
        return is_own and self.FORM.is_whole(place)

    def run(self) -> TissueClasses:
        """Return the classes. Raises SourceError."""
        method = self.method
        if isinstance(method, Network):
            settings, learned = method.settings(), self._apply(method)
        else:
            settings, learned = asdict(method), self._learn(method)
        colors = dict(HEAD)
        classes = tuple(
            TissueClass(
                name,
                colors.get(name, self.palette[k % len(self.palette)]),
                learned.intensities[k],
                np.rint(255 * learned.probabilities[k]).astype(np.uint8),
            )
            for k, name in enumerate(learned.names)
        )
        record = {
            "format": "stereocell-tissue",
            "version": 1,
            "generator": GENERATOR,
            "key": self.key,
            "fingerprint": self.voxels.ref.fingerprint,
            "channel": self.channel,
            "settings": settings,
            "bic": dict(learned.bic),
            "classes": [self._described(one) for one in classes],
            "libraries": libraries_of(type(self).__name__),
        }
        return TissueClasses(
            classes,
            record,
            self.region.start,
            open_source(self.voxels.ref).levels[self.voxels.level].shape,
            self.voxels.spacing_um,
            self.voxels.origin_um,
        )

    def _learn(self, options: TissueOptions) -> Learned:
        volume = self.voxels.read(self.region)
        found = learn_tissue(volume.voxels, self.voxels.spacing_um, options=options)
        means = tuple(float(mean) for mean in found.means[:, 0])
        bic = {str(count): value for count, value in found.bic.items()}
        names = tuple(f"tissue {k + 1}" for k in range(len(means)))
        if options.brain and len(means) == len(HEAD):
            names = tuple(name for name, _ in HEAD)
        return Learned(found.probabilities, means, names, bic)

    def _apply(self, network: Network) -> Learned:
        found = apply_network(network, self.voxels.read(self.region).voxels)
        kept = [k for k, name in enumerate(network.classes) if name]
        names = tuple(network.classes[k] for k in kept)
        return Learned(found[kept], (None,) * len(kept), names, {})

    def _described(self, one: TissueClass) -> dict[str, Any]:
        """Return the entry of a class in the record."""
        voxel_mm3 = math.prod(length / 1000 for length in self.voxels.spacing_um)
        return {
            "name": one.name,
            "color": list(one.color),
            "intensity": one.intensity,
            "volume_mm3": float(one.probabilities.sum(dtype=np.float64) / 255 * voxel_mm3),
        }

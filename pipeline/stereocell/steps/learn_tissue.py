"""The step that learns the tissue classes of a channel, or applies a network to it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stereocell.engine.step import Keyed
from stereocell.model.tiling import Box
from stereocell.steps.open_source import Voxels
from stereocell.tissue.classify import TissueOptions, learn_tissue
from stereocell.tissue.onnx_classifier import Network, apply_network


@dataclass(frozen=True, slots=True)
class Learned:
    """The classes that were found.

    probabilities  float32 (n, z, y, x), 0..1
    intensities    mean of each class, bias removed; None: a network does not know it
    names          of a network's classes; empty: the classes were learned
    bic            Bayesian information criterion by number of classes; empty for a network
    """

    probabilities: NDArray[np.float32]
    intensities: tuple[float | None, ...]
    names: tuple[str, ...]
    bic: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class LearnTissue(Keyed):
    """Learn the classes of a channel in the planned region.

    The command runs this step itself (building/tissue.py): its network lives in a child process of
    the command, its errors are the command's, and the plan names and colours the classes that are
    written.

    channel   its name, which the record states
    settings  of the method, as the record states them: a network counts by its digest
    """

    VERSION: ClassVar[int] = 1

    voxels: Voxels
    region: Box
    channel: str
    settings: Mapping[str, Any]

    def learn(self, options: TissueOptions, network: Network | None) -> Learned:
        """Return the classes. Raises SourceError, ModelError.

        options  those of `settings`, without a network
        network  the one whose settings are `settings`; None: the classes are learned
        """
        volume = self.voxels.read(self.region)
        if network is None:
            learned = learn_tissue(volume.voxels, self.voxels.spacing_um, options=options)
            means = tuple(float(mean) for mean in learned.means[:, 0])
            bic = {str(count): value for count, value in learned.bic.items()}
            return Learned(learned.probabilities, means, (), bic)
        found = apply_network(network, volume.voxels)
        kept = [k for k, name in enumerate(network.classes) if name]
        names = tuple(network.classes[k] for k in kept)
        return Learned(found[kept], (None,) * len(kept), names, {})

"""Measure how much of the source's voxels above the level a channel's surface encloses.

Voxels that only noise lifts above the level are not counted, because no surface should enclose
them. If the level lies one deviation of the noise above the background, they are a sixth of it.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.isosurface.lifted_by_noise import Lifted, count_lifted
from stereocell.model.unit import MAX_MISSING, Cover
from stereocell.planning.plan import Plan
from stereocell.planning.survey import ChannelSurvey
from stereocell.steps.find_window import FindWindow
from stereocell.steps.gather_evidence import GatherEvidence
from stereocell.steps.unit_files import cover_of, load_record

# Remedies for a surface that leaves out much. They were tried on a CT of a trunk with voxels of
# 3 mm, at 300 HU. The first reduced the part left out from 59 % to 17 %, both together to 5 %.
REMEDY = (
    "in a file for --config, under [surface], write max_shift = 0.02 to keep thin structures, "
    "and min_diagonal_um = 0 and max_fragment_um = 0 to keep small ones"
)
NO_REMEDY = "settings that keep such structures would also keep much of this noise"
# Least number of voxels of structure for each voxel of noise at which the remedy is advised. With
# 60 dim nuclei in noise the remedy makes 54 times as many triangles, most of them noise.
LEAST_GAIN = 3.0


@dataclass(frozen=True, slots=True)
class SurfaceCover:
    """How much of the source's voxels above the level the solids of a channel enclose.

    cover   counts without the voxels that only noise lifts above the level
    lifted  number of these voxels, which lie outside of the solid
    """

    cover: Cover
    lifted: int

    @classmethod
    def of(cls, cover: Cover, lifted: Lifted) -> "SurfaceCover":
        """Return the cover measured by the units, without the voxels that only noise lifts.

        Near the surface, noise lifts as many voxels above the level as it takes below. The latter
        lie in the solid and can be counted. So at most as many voxels near the level count as
        noise.
        """
        added, left_out = cover.solid - cover.covered, cover.source - cover.covered
        noise = min(left_out, round(lifted.far + min(lifted.near, added)))
        return cls(Cover(cover.source - noise, cover.covered, cover.solid), noise)

    @property
    def missing(self) -> float:
        """The share of the source's voxels above the level that the solid leaves out, 0..1."""
        return self.cover.missing

    @property
    def words(self) -> str:
        """The shares as text for a reader."""
        beside = f"; noise alone lifts about {self.lifted:,} others above it" if self.lifted else ""
        return self.cover.words + beside

    @property
    def remedy(self) -> str:
        """The settings that keep the structures left out, or why there are no such settings."""
        left_out = self.cover.source - self.cover.covered
        return REMEDY if left_out >= LEAST_GAIN * self.lifted else NO_REMEDY


def notes_on_cover(out_folder: OutFolder, plan: Plan) -> list[str]:
    """Return a line for each channel that loses more than MAX_MISSING. All units must be built."""
    index, survey, notes = out_folder.index(), read_survey(out_folder), []
    for channel in plan.channels:
        total = Cover(0, 0, 0)
        for tile in plan.tiles:
            name = f"{tile.id}/{channel.id}"
            cover = cover_of(load_record(out_folder.unit_dir(name, index[name])))
            total += cover or Cover(0, 0, 0)
        if total.missing <= MAX_MISSING:
            continue
        lifted = lifted_by_tile(out_folder, plan, survey[channel.id])
        found = SurfaceCover.of(total, sum_lifted(lifted.values()))
        if found.missing > MAX_MISSING:
            noise = f", not counting about {found.lifted:,} that only noise lifts there" * bool(
                found.lifted
            )
            notes.append(
                f"{channel.name}: its surface leaves out {found.missing:.0%} of the source's "
                f"voxels above its iso-value{noise}, because filters and cleaning remove thin and "
                f"small structures: {found.remedy}"
            )
    return notes


def lifted_by_tile(out_folder: OutFolder, plan: Plan, survey: ChannelSurvey) -> dict[str, Lifted]:
    """Return how many voxels noise lifts above a channel's level in each tile, by tile ID.

    Tiles without the file of their evidence are left out, and all tiles if no noise was measured
    because smoothing is not bounded.
    """
    window = FindWindow.FORM.find(out_folder.out / survey.statistics_file)
    deviations = plan.settings.surface.max_shift
    if not window or not window.max_shift or not deviations or window.counting.mask is not None:
        return {}
    is_above, noise = survey.statistics.background is not None, window.max_shift / deviations
    scale = window.counting.scale_above if is_above else window.counting.scale
    edges = None if scale is None else scale.edges()
    found = {}
    for tile_id, iso in survey.iso.items():
        file = iso.files.get("evidence")
        evidence = None if file is None else GatherEvidence.FORM.find(out_folder.out / file)
        if evidence is None or iso.value is None or edges is None:
            continue
        sums = evidence.above if is_above else evidence.plain
        if sums is not None:
            found[tile_id] = count_lifted(sums.counts, edges, level=iso.value, noise=noise)
    return found


def sum_lifted(lifted: Iterable[Lifted]) -> Lifted:
    """Return the sum over tiles."""
    return sum(lifted, Lifted(0.0, 0.0))

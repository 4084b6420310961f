"""Name the channels whose surface leaves out much of what the source has above its level."""

from stereocell.building.out_folder import OutFolder
from stereocell.building.plan import Plan
from stereocell.building.unit_files import cover_of, load_record
from stereocell.model.unit import MAX_MISSING, Cover

# Both were tried on a CT of a trunk in voxels of 3 mm, at 300 HU: from 59 % left out to 17 and 5 %.
REMEDY = (
    "in a file for --config, under [surface], max_shift = 0.02 keeps thin ones, and "
    "min_diagonal_um = 0 with max_fragment_um = 0 small ones"
)


def notes_on_cover(out_folder: OutFolder, plan: Plan) -> list[str]:
    """Return a line for each channel that loses more than MAX_MISSING; all units are built."""
    index, notes = out_folder.index(), []
    for channel in plan.channels:
        total = Cover(0, 0, 0)
        for tile in plan.tiles:
            key = index[f"{tile.id}/{channel.id}"]
            cover = cover_of(load_record(out_folder.unit_dir(tile.id, channel.id, key)))
            total += cover or Cover(0, 0, 0)
        if total.missing > MAX_MISSING:
            notes.append(
                f"{channel.name}: its surface leaves out {total.missing:.0%} of the source's "
                "voxels above its level: filters and cleaning remove thin and small structures; "
                f"{REMEDY}"
            )
    return notes

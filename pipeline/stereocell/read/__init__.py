"""Sources become lazy datasets: voxels (z, y, x), lengths in um, whatever the format held."""

from stereocell.read.dataset import ChannelInfo, Dataset, Level
from stereocell.read.open_dataset import list_series, open

__all__ = ["ChannelInfo", "Dataset", "Level", "list_series", "open"]

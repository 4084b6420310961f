"""Readers turn a source into a lazy dataset of voxels (z, y, x), with all lengths in um."""

from stereocell.read.dataset import ChannelInfo, Dataset, Level
from stereocell.read.open_dataset import open
from stereocell.read.readers import list_series, series_order

__all__ = ["ChannelInfo", "Dataset", "Level", "list_series", "open", "series_order"]

"""StereoCell: multi-channel volumes as USD stages, web bundles and stereo views.

`build` does all that the command of that name does; `open_volume` reads a source; `show` opens the
viewer in a notebook. The steps on the way are plain functions on numpy arrays, each in a module of
its own (docs/python.md).
"""

from stereocell.api import Built, build, open_volume
from stereocell.model.errors import StereoCellError
from stereocell.notebook.show import show

__all__ = ["Built", "StereoCellError", "build", "open_volume", "show"]

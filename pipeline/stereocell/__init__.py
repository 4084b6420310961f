"""StereoCell: multi-channel volumes as USD stages, web bundles and stereo views.

`build` does the same as the command of that name, `open_volume` opens a source for reading, and
`show` opens the viewer in a notebook. The steps of a build are plain functions on numpy arrays,
each in a module of its own (docs/python.md).
"""

from stereocell.api import Built, build, open_volume
from stereocell.model.errors import StereoCellError
from stereocell.notebook.show import show

__all__ = ["Built", "StereoCellError", "build", "open_volume", "show"]

"""The viewer's page as a notebook's frame has it: one document, and the files that it takes.

The frame has no origin and no address, so the page can fetch nothing: `frame.js` makes its files
addresses of their own (blob:), and its policy lets it reach these alone.
"""

import base64
import hashlib
from functools import cache
from pathlib import Path

from stereocell.model.errors import UsageError
from stereocell.storage.assets import viewer_dist

_FRAME = Path(__file__).with_name("frame.js")
_TAKEN = {".js", ".css", ".wasm"}
# a worker from blob: has the frame's policy, and that of textures makes functions of text
_POLICY = (
    "default-src 'none'; script-src blob: 'unsafe-eval' 'sha256-{boot}'; style-src blob:; "
    "img-src data: blob:; connect-src data: blob:; worker-src blob:; base-uri 'none'; "
    "form-action 'none'"
)
_DOCUMENT = """<!doctype html>
<html lang="en">
  <head>
    <meta charset="utf-8" />
    <meta http-equiv="Content-Security-Policy" content="{policy}" />
    <meta name="viewport" content="width=device-width, initial-scale=1" />
    <meta name="color-scheme" content="dark" />
    <title>StereoCell</title>
  </head>
  <body>
    <div id="app"></div>
    <script>{boot}</script>
  </body>
</html>
"""


def find_page() -> Path:
    """Return the folder of the built viewer. Raises UsageError where there is none."""
    folder = viewer_dist()
    if folder is None:
        raise UsageError("the viewer is not built: run `make setup`, or install the wheel")
    return folder


def document() -> str:
    """Return the frame's document."""
    boot = _FRAME.read_text("utf-8")
    digest = base64.b64encode(hashlib.sha256(boot.encode()).digest()).decode()
    return _DOCUMENT.format(policy=_POLICY.format(boot=digest), boot=boot)


@cache
def files() -> dict[str, bytes]:
    """Return the page's files by name, packed by gzip where that is shorter."""
    taken = {}
    for file in sorted((find_page() / "assets").iterdir()):
        if file.suffix in _TAKEN:
            packed = file.with_name(f"{file.name}.gz")
            taken[file.name] = (packed if packed.is_file() else file).read_bytes()
    return taken


@cache
def key() -> str:
    """Return what tells this page from others: a view that comes again need not ask for it."""
    digest = hashlib.sha256(document().encode())
    digest.update("\n".join(files()).encode())
    return digest.hexdigest()[:16]

"""Make the viewer's page as one document without an address, for a notebook or a single file.

The document can't fetch files. `blob_page.js` gives each file of the page its own `blob:` address,
and the document's policy allows only these addresses.
"""

import base64
import hashlib
from functools import cache
from pathlib import Path

from stereocell.model.errors import UsageError
from stereocell.storage.assets import viewer_dist

_START = Path(__file__).with_name("blob_page.js")
_TAKEN = {".js", ".css", ".wasm"}
# The policy needs 'unsafe-eval': workers inherit it, and the one that decodes textures calls eval.
_POLICY = (
    "default-src 'none'; script-src blob: 'unsafe-eval' 'sha256-{boot}'; style-src blob:; "
    "img-src data: blob:; connect-src data: blob:; worker-src blob:; base-uri 'none'; "
    "form-action 'none'"
)
_DOCUMENT = """<!doctype html>
<html lang="en">
  <head>
    <meta charset="utf-8" />
    <title>StereoCell</title>
    <meta http-equiv="Content-Security-Policy" content="{policy}" />
    <meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover" />
    <meta name="color-scheme" content="dark light" />
    <link rel="icon" href="data:," />
  </head>
  <body>
    <div id="app"></div>
{data}    <script>{boot}</script>
  </body>
</html>
"""


def find_page() -> Path:
    """Return the folder of the built viewer. Raises UsageError if it is not built."""
    folder = viewer_dist()
    if folder is None:
        raise UsageError("the viewer is not built: run `make setup`, or install the wheel")
    return folder


def document(script: Path, data: str = "") -> str:
    """Return a document that runs blob_page.js and then `script`.

    data  lines of HTML that the script reads; they must not contain scripts that run
    """
    boot = "\n".join(file.read_text("utf-8") for file in (_START, script))
    digest = base64.b64encode(hashlib.sha256(boot.encode()).digest()).decode()
    return _DOCUMENT.format(policy=_POLICY.format(boot=digest), boot=boot, data=data)


@cache
def files() -> dict[str, bytes]:
    """Return the page's scripts, styles and WASM by name, as gzip if the build has packed them."""
    taken = {}
    for file in sorted((find_page() / "assets").iterdir()):
        if file.suffix in _TAKEN:
            packed = file.with_name(f"{file.name}.gz")
            taken[file.name] = (packed if packed.is_file() else file).read_bytes()
    return taken

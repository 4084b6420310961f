"""Command lines whose input does not exist: a command ends as soon as it has looked for it."""

_OUT, _SOURCE = "/missing/out", "/missing/specimen.ome.tif"
MISSING_INPUTS = {
    "build": ["build", _SOURCE, "-o", _OUT],
    "plan": ["plan", _SOURCE, "-o", _OUT],
    "iso": ["iso", _SOURCE, "--channel", "0", "--tile", "r0_c0", "-o", "/missing/iso.png"],
    "slices": ["slices", _SOURCE, "-o", _OUT],
    "units": ["units", _OUT],
    "stage": ["stage", _OUT],
    "bundle": ["bundle", _OUT],
    "export": ["export", _OUT, "/missing/cells.glb"],
    "publish": ["publish", _OUT, "/missing/site"],
    "report": ["report", _OUT],
    "tissue": ["tissue", _OUT],
    "check": ["check", _OUT],
    "view of a build": ["view", _OUT],
    "view of a source": ["view", _SOURCE],
    "serve": ["serve", _OUT],
}

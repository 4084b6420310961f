"""How long a test's client waits for an answer. A slow answer of a busy machine is not a fault."""

from functools import partial

from websockets.sync import client

PATIENCE_S = 120.0

connect = partial(client.connect, open_timeout=PATIENCE_S, ping_timeout=None)

"""How long a test's client waits for an answer: a busy machine is slow, and no fault."""

from functools import partial

from websockets.sync import client

PATIENCE_S = 120.0

connect = partial(client.connect, open_timeout=PATIENCE_S, ping_timeout=None)

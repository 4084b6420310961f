"""Ask a running server for all bricks of some volumes."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from support.server.brick_client import BrickClient, look_at
from support.server.timeouts import connect

_SMALL = ([0, -48, 0], [36, 0, 32])  # um, opposite corners of a box round tests' small specimens


def sent(
    port: int, path: str, volumes: list[dict[str, str]], box: Sequence[Sequence[float]] = _SMALL
) -> BrickClient:
    """Return a client that has received all bricks of these volumes, or the errors for them.

    box  um, opposite corners of the box that the camera looks at from the front
    """
    client, opened = BrickClient(), 0
    with connect(f"ws://localhost:{port}{path}") as socket:

        def say(**message: Any) -> None:
            socket.send(json.dumps(message))

        say(type="hello", version=1)
        say(type="open", volumes=volumes)
        while opened < len(volumes):
            for answer in client.take(socket.recv()):
                say(**answer)
            errors = sum(one["type"] == "error" for one in client.messages)
            opened = errors + sum(client.is_ready(tree) for tree in client.trees)
        if client.trees:
            (low, high), middle = np.array(box, float), np.mean(box, axis=0)
            away = [0, 0, 3 * np.linalg.norm(high - low)]
            view = look_at(middle + away, middle, far=10 * away[2])
            fineness = {"pixels_per_radian": 1e6, "texel_px": 0.001, "budget": 10**8}
            say(type="view", id=1, trees=list(client.trees), **view, **fineness)
            while 1 not in client.done:
                for answer in client.take(socket.recv()):
                    say(**answer)
    return client

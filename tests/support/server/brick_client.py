"""A client of `/bricks` in numpy, without a network: it takes messages and returns answers.

It was written from docs/brick-stream.md, and does what the browser's client does.
"""

import json
from base64 import b64encode
from dataclasses import dataclass, field

import numpy as np

from stereocell.formats.brick_stream import (
    BRICKS_FRAME,
    TABLE_FRAME,
    Table,
    content_hash,
    parse_table,
)
from stereocell.formats.voxel_bvh import EMPTY, STORED, STREAM_BRICK, upsampling
from support.server.brick_decoder import decode_brick, decode_frame


@dataclass
class ClientTree:
    message: dict
    raw: bytearray
    table: Table | None = None
    frames: dict[int, bytes] = field(default_factory=dict)  # zstd frames by node


@dataclass
class BrickClient:
    trees: dict[int, ClientTree] = field(default_factory=dict)
    messages: list[dict] = field(default_factory=list)
    done: dict[int, dict] = field(default_factory=dict)
    order: list[tuple[int, int, int]] = field(default_factory=list)  # view, tree, node
    brick_bytes: int = 0
    table_bytes: int = 0

    def take(self, data: str | bytes, tables: dict[str, bytes] | None = None) -> list[dict]:
        """Process a message of the server, and return the client's answers.

        tables  bytes of cached tables by their hashes
        """
        if isinstance(data, str):
            return self._take_text(json.loads(data), tables or {})
        frame = decode_frame(data)
        for part in frame.parts:
            tree = self.trees[part.tree]
            if frame.kind == TABLE_FRAME:
                assert part.at == len(tree.raw)
                tree.raw += part.data
                self.table_bytes += len(part.data)
                self._parse(tree)
            else:
                assert frame.kind == BRICKS_FRAME
                node = tree.table.nodes[part.at]
                assert content_hash(part.data) == node["hash"].tobytes()
                tree.frames[part.at] = part.data
                self.order.append((frame.view, part.tree, part.at))
                self.brick_bytes += len(part.data)
        return [{"type": "ack", "sequence": frame.sequence}]

    def _take_text(self, message: dict, tables: dict[str, bytes]) -> list[dict]:
        self.messages.append(message)
        if message["type"] == "tree":
            tree = self.trees[message["tree"]] = ClientTree(message, bytearray())
            if not message["table_follows"]:
                tree.raw += tables[message["table"]]
                self._parse(tree)
        if message["type"] == "done":
            assert message["view"] not in self.done, "one `done` for each view"
            self.done[message["view"]] = message
        return []

    @staticmethod
    def _parse(tree: ClientTree) -> None:
        if len(tree.raw) == tree.message["table_bytes"]:
            assert content_hash(bytes(tree.raw)).hex() == tree.message["table"]
            tree.table = parse_table(bytes(tree.raw))

    def is_ready(self, tree: int) -> bool:
        return tree in self.trees and self.trees[tree].table is not None

    def have(self, tree: int) -> dict:
        """Return the message that names the bricks of a tree that the client already has."""
        bits = np.zeros(len(self.trees[tree].table.nodes), dtype=np.uint8)
        bits[list(self.trees[tree].frames)] = 1
        packed = np.packbits(bits, bitorder="little").tobytes()
        return {"type": "have", "tree": tree, "nodes": b64encode(packed).decode()}


def reconstruct(table: Table, frames: dict[int, bytes]) -> np.ndarray:
    """Return the volume (z, y, x), float32, that a client draws with these bricks.

    Every texel is sampled in the finest available brick; without a brick it is 0.
    """
    volume = np.zeros(table.size, dtype=np.float32)
    for i, node in enumerate(table.nodes):  # breadth first: finer bricks come later
        is_empty = bool(node["flags"] & EMPTY)
        if not is_empty and i not in frames:
            continue
        level = int(node["level"])
        edge = STREAM_BRICK << level
        part = volume[tuple(slice(node[a] * edge, (node[a] + 1) * edge) for a in map(str, "zyx"))]
        if is_empty:
            part[:] = node["constant"]
            continue
        values = decode_brick(frames[i]).astype(np.float32)
        assert values.shape == (STORED,) * 3
        for axis, count in enumerate(part.shape):
            weights = upsampling(level, count)
            values = np.moveaxis(np.tensordot(weights, values, axes=(1, axis)), 0, axis)
        part[:] = values
    return volume


def psnr(found: np.ndarray, truth: np.ndarray) -> float:
    """Return the peak signal-to-noise ratio of 8-bit intensities, dB."""
    error = np.mean((found.astype(np.float64) - truth) ** 2)
    return float("inf") if error == 0 else float(10 * np.log10(255**2 / error))


def look_at(eye, target, fov_y=np.pi / 4, aspect=1.0, near=1.0, far=1e5) -> dict:
    """Return clip (column-major), eye and gaze of a camera for the message `view`."""
    eye, target = np.array(eye, float), np.array(target, float)
    forward = (target - eye) / np.linalg.norm(target - eye)
    up = np.array([0, 1.0, 0]) if abs(forward[1]) < 0.99 else np.array([0, 0, 1.0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    view = np.eye(4)
    view[:3, :3] = [right, up, -forward]
    view[:3, 3] = -view[:3, :3] @ eye
    f = 1 / np.tan(fov_y / 2)
    projection = np.zeros((4, 4))
    projection[0, 0], projection[1, 1] = f / aspect, f
    projection[2, 2], projection[2, 3] = (far + near) / (near - far), 2 * far * near / (near - far)
    projection[3, 2] = -1
    clip = projection @ view
    return {"clip": clip.T.ravel().tolist(), "eye": eye.tolist(), "gaze": forward.tolist()}

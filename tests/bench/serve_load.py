"""Load a server by fifty clients with random views for a minute; print errors, bytes and memory.

    .venv/bin/python tests/bench/serve_load.py [--clients 50] [--seconds 60] [FOLDER OF DICOM FILES]

The server is `stereocell serve` in a process of its own; the clients share another process. A
client sends a random view with a random budget and waits for the end, or sometimes sends the next
view earlier. One time in three it drops its bricks, so the server always has bricks to send. Every
frame is parsed, and one brick in twenty is compared with its hash.
"""

import argparse
import asyncio
import base64
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil

sys.path.insert(0, str(Path(__file__).parents[1]))
from machine import Spent, stated, typical
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException

from stereocell.formats.brick_stream import BRICKS_FRAME, content_hash, parse_table
from support.server.brick_bundles import write_mri
from support.server.brick_client import look_at
from support.server.brick_decoder import decode_frame

DATA = Path(os.environ.get("STEREOCELL_DATA", "../shared/data")) / "mri_t1_7t" / "dicoms"


@dataclass
class Totals:
    views: int = 0
    cancelled: int = 0
    bricks: int = 0
    bytes: int = 0
    checked: int = 0
    errors: list[str] = field(default_factory=list)
    first_s: list[float] = field(default_factory=list)
    view_s: list[float] = field(default_factory=list)


async def visit(address: str, seed: int, until: float, totals: Totals) -> None:
    """Act as one client."""
    rng = random.Random(seed)
    try:
        async with connect(address, compression=None, max_size=1 << 20) as stream:
            await stream.send('{"type": "hello", "version": 1}')
            volume = '{"tile": "r0_c0", "channel": "CD31"}'
            await stream.send(f'{{"type": "open", "volumes": [{volume}]}}')
            table, tree = b"", None
            while tree is None or len(table) < tree["table_bytes"]:
                data = await asyncio.wait_for(stream.recv(), 60)
                if isinstance(data, str):
                    message = json.loads(data)
                    tree = message if message["type"] == "tree" else tree
                    continue
                frame = decode_frame(data)
                table += frame.parts[0].data
                await stream.send(json.dumps({"type": "ack", "sequence": frame.sequence}))
            hashes = [node["hash"].tobytes() for node in parse_table(table).nodes]
            view = 0
            while time.monotonic() < until:
                view += 1
                await look(stream, view, rng, hashes, totals)
                await asyncio.sleep(rng.uniform(0, 0.2))
    except (OSError, WebSocketException, AssertionError, TimeoutError) as error:
        totals.errors.append(repr(error))


async def look(stream, view: int, rng: random.Random, hashes: list[bytes], totals: Totals) -> None:
    if rng.random() < 1 / 3:
        nothing = bytes((len(hashes) + 7) // 8)
        have = {"type": "have", "tree": 0, "nodes": base64.b64encode(nothing).decode()}
        await stream.send(json.dumps(have))
    middle = np.array([137, -192, 192])
    eye = middle + np.array([rng.gauss(0, 1) for _ in range(3)]) * rng.uniform(50, 500)
    target = middle + np.array([rng.uniform(-80, 80) for _ in range(3)])
    message = {
        **{"type": "view", "id": view, "trees": [0], "pixels_per_radian": 1000},
        **{"texel_px": rng.choice([0.5, 1, 2, 4]), "budget": rng.randrange(50_000, 3_000_000)},
        **look_at(eye, target),
    }
    start = time.monotonic()
    await stream.send(json.dumps(message))
    hurried = rng.random() < 0.2
    first = None
    while True:
        data = await asyncio.wait_for(stream.recv(), 60)
        if isinstance(data, str):
            answer = json.loads(data)
            assert answer["type"] == "done", answer
            if answer["view"] == view:
                totals.cancelled += answer["reason"] == "cancelled"
                break
            continue
        frame = decode_frame(data)
        totals.bytes += len(data)
        if frame.kind == BRICKS_FRAME:
            if first is None and frame.view == view:
                first = time.monotonic() - start
                totals.first_s.append(first)
            totals.bricks += len(frame.parts)
            for part in frame.parts:
                if rng.random() < 0.05:
                    assert content_hash(part.data) == hashes[part.at], f"node {part.at}"
                    totals.checked += 1
        await stream.send(json.dumps({"type": "ack", "sequence": frame.sequence}))
        if hurried:
            hurried = False
            await stream.send(json.dumps({"type": "cancel", "id": view}))
    totals.views += 1
    totals.view_s.append(time.monotonic() - start)


def memory_mb(pid: int, name: str) -> float:
    for line in Path(f"/proc/{pid}/status").read_text("utf-8").splitlines():
        if line.startswith(name + ":"):
            return int(line.split()[1]) / 1024
    return float("nan")


async def load(address: str, pid: int, clients: int, seconds: float) -> Totals:
    totals = Totals()
    until = time.monotonic() + seconds
    visits = [asyncio.create_task(visit(address, i, until, totals)) for i in range(clients)]
    for k in range(6):
        await asyncio.sleep(seconds / 6)
        rss = memory_mb(pid, "VmRSS")
        print(f"  {(k + 1) * seconds / 6:5.0f} s: {totals.views:6,} views, server {rss:6.0f} MB")
    await asyncio.gather(*visits)
    return totals


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("source", nargs="?", type=Path, default=DATA)
    parser.add_argument("--clients", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=60)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = write_mri(Path(folder) / "out", options.source)
        command = [sys.executable, "-m", "stereocell.cli", "serve", str(out), "--port", "0"]
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as server:
            try:
                assert server.stdout is not None
                address = f"ws{server.stdout.readline().split()[0][4:]}bricks"
                start = memory_mb(server.pid, "VmRSS")
                process = psutil.Process(server.pid)
                before = sum(process.cpu_times()[:2])
                totals = asyncio.run(load(address, server.pid, options.clients, options.seconds))
                cpu = sum(process.cpu_times()[:2]) - before
                peak, last = (memory_mb(server.pid, n) for n in ("VmHWM", "VmRSS"))
            finally:
                server.terminate()
                _, printed = server.communicate(timeout=20)
    views, s = totals.views, options.seconds
    print(f"{options.clients} clients, {s:g} s: {views:,} views ({views / s:.0f} a second),")
    print(f"{totals.cancelled:,} of them cancelled; {totals.bricks:,} bricks,")
    print(f"{totals.bytes / 1e6:,.0f} MB ({totals.bytes / 1e6 / s:.0f} MB a second),")
    print(f"{totals.checked:,} bricks compared with their hashes")
    for name, times in (("first brick", totals.first_s), ("whole view", totals.view_s)):
        half, most = np.percentile(times, (50, 95))
        print(f"{name}: median {half * 1e3:.0f} ms, 95 % within {most * 1e3:.0f} ms")
    print(f"server: {start:.0f} MB at first, {last:.0f} MB at the end, peak {peak:.0f} MB")
    print(f"server meanwhile: {typical(Spent(options.seconds, cpu))}")
    print(f"errors: {len(totals.errors)} {totals.errors[:3]}")
    print(f"server ended with {server.returncode}, printed {printed!r}")
    return 1 if totals.errors or printed or server.returncode else 0


if __name__ == "__main__":
    with stated():
        sys.exit(main())

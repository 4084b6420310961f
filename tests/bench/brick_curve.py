"""Compare pictures after equal bytes: bricks chosen by view, and mip levels of the KTX2 file.

    .venv/bin/python tests/bench/brick_curve.py [OUT | FOLDER OF DICOM FILES]

The bundle is that of OUT, or is built from the images with the preset mri (minutes), so it has its
own surface and transfer functions. The largest volume of the first channel is measured.

The bench also prints the time to build the tree, its size, its difference from the volume, and its
size for each of the channel's functions. PSNR compares the volume as a client would sample it
(tests/support/server/brick_client.py) with the original, when all of it is in view.
"""

import json
import os
import sys
import tempfile
import time
from pathlib import Path
from threading import Thread

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from machine import Spent, stated, timed, typical
from websockets.sync.client import connect

from stereocell.cli.__main__ import main as stereocell
from stereocell.filters.min_max_bricks import mip_levels
from stereocell.formats.brick_stream import encode_tree
from stereocell.formats.ktx2 import decode_finest
from stereocell.formats.voxel_bvh import build
from stereocell.serve.brick_library import BrickLibrary
from stereocell.serve.server import BundleServer
from stereocell.serve.tree_files import Volume
from stereocell.transfer.opacity import invisible_below
from support.server.brick_client import BrickClient, look_at, psnr, reconstruct
from support.server.brick_decoder import reassemble

DATA = Path(os.environ.get("STEREOCELL_DATA", "../shared/data")) / "mri_t1_7t" / "dicoms"
SHARES = (0.0005, 0.002, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0)


def main(source: Path) -> int:
    with tempfile.TemporaryDirectory() as folder:
        out = source
        if not (source / "bundle" / "manifest.json").is_file():
            out = Path(folder) / "out"
            status = stereocell(["build", str(source), "-o", str(out), "--preset", "mri"])
            if status:
                return status
        # Trees go to another folder than OUT/bricks, so they are built again.
        library = BrickLibrary(out / "bundle", Path(folder) / "bricks")
        manifest = json.loads((out / "bundle" / "manifest.json").read_text("utf-8"))
        channel = manifest["channels"][0]
        volume = max(
            (v for v in library.volumes().values() if v.channel == channel["id"]),
            key=lambda v: int(np.prod(v.entry["size"])),
        )
        texture = (out / "bundle" / volume.entry["file"]["path"]).read_bytes()
        voxels = decode_finest(texture)[..., 0]
        print(f"tile {volume.tile}, channel {volume.channel}, drawn by its function", end=" ")
        print(f"`{channel['transfer_function']}`")
        print_build(voxels, volume.threshold, len(texture))
        print_functions(out / "bundle", channel, voxels, len(texture))
        shown = np.where(voxels > volume.threshold, voxels, 0)
        print(f"\nmip levels of the KTX2 file, coarse to fine ({len(texture):,} bytes)")
        print(f"{'bytes':>12} {'PSNR dB':>8} {'above threshold':>16}")
        spent = 0
        levels = mip_levels(voxels)
        for level, place in reversed(list(zip(levels, volume.entry["levels"], strict=True))):
            spent += place["length"]
            if min(level.shape) >= 8:
                drawn = stretch(level, voxels.shape)
                seen = psnr(np.where(drawn > volume.threshold, drawn, 0), shown)
                print(f"{spent:12,} {psnr(drawn, voxels):8.2f} {seen:16.2f}")
        print_stream(out, volume, voxels, shown)
    return 0


def print_build(voxels: np.ndarray, threshold: int, ktx2_bytes: int) -> None:
    builds, encodings = list[Spent](), list[Spent]()
    for _ in range(3):
        with timed() as spent:
            bvh = build(voxels, threshold)
        builds.append(spent)
        with timed() as spent:
            data = encode_tree(bvh, bytes(16))
        encodings.append(spent)
    again = reassemble(bvh)
    differs = again != voxels
    above = int(np.count_nonzero(differs & ((voxels > threshold) | (again > threshold))))
    print(f"volume {voxels.shape} (z, y, x), threshold {threshold}")
    for name, rounds in (("build", builds), ("serialise", encodings)):
        print(f"{name:9} {typical(*rounds)} (medians of 3)")
    print(f"{len(bvh.nodes):,} nodes, {len(bvh.bricks):,} bricks, {len(data):,} bytes")
    print(f"of the KTX2 file's bytes: {len(data) / ktx2_bytes:.2f}")
    print(f"texels that came back otherwise: {differs.mean():.4f} of all, above threshold: {above}")


def print_functions(bundle: Path, channel: dict, voxels: np.ndarray, ktx2_bytes: int) -> None:
    """Print the size of the tree if the stage opened with another function."""
    rows = decode_finest((bundle / channel["lut"]["path"]).read_bytes())[0]
    print(f"\n{'function':>12} {'threshold':>9} {'bytes':>12} {'of KTX2':>8}")
    for name, row in zip(channel["transfer_functions"], rows, strict=True):
        threshold = invisible_below(row[:, 3])
        size = len(encode_tree(build(voxels, threshold), bytes(16)))
        print(f"{name:>12} {threshold:9} {size:12,} {size / ktx2_bytes:8.2f}")


def print_stream(out: Path, volume: Volume, voxels: np.ndarray, shown: np.ndarray) -> None:
    server = BundleServer(out, 0, lan=False)
    thread = Thread(target=server.run)
    thread.start()
    client = BrickClient()
    camera = look_from_front(volume.entry)
    while not server.has_started:
        time.sleep(0.01)
    try:
        with connect(f"ws://localhost:{server.port}/bricks", compression=None) as stream:

            def until(is_over) -> None:
                while not is_over():
                    for answer in client.take(stream.recv(timeout=60)):
                        stream.send(json.dumps(answer))

            stream.send('{"type": "hello", "version": 1}')
            wanted = {"tile": volume.tile, "channel": volume.channel}
            with timed() as spent:
                stream.send(json.dumps({"type": "open", "volumes": [wanted]}))
                until(lambda: client.is_ready(0))
            tree = client.trees[0]
            print(f"\nbricks by view, gaze in the middle (table {client.table_bytes:,} bytes,")
            print(f"first `tree` after {typical(spent)})")
            print(f"{'bytes':>12} {'bricks':>7} {'PSNR dB':>8} {'above threshold':>16} {'s':>6}")
            whole = Spent()
            for id, share in enumerate(SHARES, 1):
                budget = int(share * tree.table.brick_bytes) - client.brick_bytes
                view = {"type": "view", "id": id, "trees": [0], "budget": max(budget, 0)}
                with timed() as spent:
                    message = view | {"pixels_per_radian": 1e3, "texel_px": 0} | camera
                    stream.send(json.dumps(message))
                    until(lambda id=id: id in client.done)
                whole = Spent(whole.seconds + spent.seconds, whole.cpu + spent.cpu)
                drawn = reconstruct(tree.table, tree.frames)
                seen = psnr(np.where(drawn > volume.threshold, drawn, 0), shown)
                print(
                    f"{client.brick_bytes:12,} {len(tree.frames):7,} {psnr(drawn, voxels):8.2f}"
                    f" {seen:16.2f} {whole.seconds:6.2f}"
                )
            print(f"server and client together: {typical(whole)}")
            left = tree.table.nodes["length"].astype(bool).sum() - len(tree.frames)
            print(f"`{client.done[len(SHARES)]['reason']}`; never in sight, apron alone: {left}")
    finally:
        server.stop()
        thread.join()


def look_from_front(entry: dict) -> dict:
    """Return a camera at +z that sees a whole volume; its matrix applies to the box."""
    to_world = np.array(entry["matrix"]).reshape(4, 4).T
    low, high = (np.array(entry["bounds_um"][key]) for key in ("min", "max"))
    middle = (to_world @ np.append((low + high) / 2, 1))[:3]
    diagonal = float(np.linalg.norm(to_world[:3, :3] @ (high - low)))
    eye = middle + np.array([0, 0, 1.5 * diagonal])
    return look_at(eye, middle, near=0.1 * diagonal, far=10 * diagonal)


def stretch(level: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Sample a mip level trilinearly at the centres of the finest texels of the same box."""
    values = level.astype(np.float32)
    for axis, n in enumerate(shape):
        m = values.shape[axis]
        at = np.clip((np.arange(n) + 0.5) * m / n - 0.5, 0, m - 1)
        low = np.minimum(at.astype(int), m - 1)
        high = np.minimum(low + 1, m - 1)
        weight = (at - low).astype(np.float32).reshape(-1, *[1] * (2 - axis))
        values = np.take(values, low, axis) * (1 - weight) + np.take(values, high, axis) * weight
    return values


if __name__ == "__main__":
    with stated():
        sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else DATA))

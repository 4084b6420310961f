"""Measure how much builds read of their source, and estimate it for the whole CyCIF dataset.

The ratio of the bytes read to the bytes of touched chunks is measured on small tiles. The chunks
that the dataset's tiles touch are counted one by one, because small tiles touch other shares of
chunks.
"""

import itertools
import math
import sys
import threading
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import zarr

sys.path.insert(0, str(Path(__file__).parents[1]))
from commands import call, make_sample, plan

from stereocell.building.out_folder import OutFolder
from stereocell.isosurface.level_evidence import HALO, denoising_reach
from stereocell.model.sample_boxes import sample_boxes
from stereocell.model.tiling import Box, cut
from stereocell.planning.plan_source import source_of
from stereocell.planning.survey_steps import evidence_step, window_step
from stereocell.steps.find_window import JOINT_VOXELS, SURVEY_VOXELS
from stereocell.steps.open_source import open_afresh
from support.phantoms import write_ome_zarr

REAL = (194, 512, 512)
REGION, CHANNELS = Box((0, 0, 0), (194, 5508, 10908)), 70  # voxels of the whole CyCIF dataset
CHUNK = (32, 128, 128)  # voxels (z, y, x): a tile is four chunks wide and some six deep
CHECKS = 2  # number of times that a command reads a source by http to see that it is the same
MAX_READ = 1.3  # ratio of the bytes read to the bytes of touched chunks


@contextmanager
def counting(folder: Path) -> Iterator[tuple[str, dict[str, int]]]:
    """Serve a folder; count the bytes that are sent of each file."""
    sent: dict[str, int] = defaultdict(int)
    lock = threading.Lock()

    class Handler(SimpleHTTPRequestHandler):
        def copyfile(self, source: object, outputfile: object) -> None:
            file = Path(self.translate_path(self.path))
            if file.is_file():  # listings of folders are not counted
                with lock:
                    sent[str(file)] += file.stat().st_size
            super().copyfile(source, outputfile)  # type: ignore[arg-type]

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}", sent
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@dataclass(frozen=True)
class Reading:
    """Stored bytes that builds read.

    chunks   bytes that a unit reads, as a ratio to the chunks that its window touches
    window   bytes that a unit reads, as a ratio to the window itself
    check    bytes that a command reads to recognise the planned source: CHECKS times 64 MB at most
    """

    chunks: float
    window: float
    check: int


@dataclass(frozen=True)
class Survey:
    """Bytes read for iso-values, if tiles are four chunks wide, as with REAL and CHUNK.

    chunks  ratio to the bytes of the chunks that the tiles touch with their halos
    tiles   ratio to the bytes of the tiles themselves
    halo    voxels (z, y, x) around a tile that are read, too
    """

    chunks: float
    tiles: float
    halo: tuple[int, int, int]


def measure_reading(folder: Path, tile: tuple[int, int, int]) -> Reading:
    source = make_sample(folder, (3, 3), tile)
    out = folder / "reading"
    with counting(folder) as (address, sent):
        plan(f"{address}/{source.name}", out, (3, 3), tile, "0")
        for unit in ("r0_c0/0", "r1_c1/0"):  # the first command also surveys all nine tiles
            take(sent)
            call("units", str(out), "--workers", "0", "--only", unit)
        whole = take(sent)
        open_afresh(source_of(OutFolder(out).plan())).fingerprint  # noqa: B018  it is computed now
        check = CHECKS * take(sent)
    read = whole - check
    settled = OutFolder(out).plan()
    middle = settled.tile("r1_c1")  # this tile has neighbours on all sides
    window = middle.lattice(settled.region).grown(settled.halo, settled.region)
    size = stored(source, window)
    share = math.prod(window.shape) / touched(window, chunk_of(source), settled.region)
    return Reading(read / size, read / (size * share), check)


def measure_survey(folder: Path, tile: tuple[int, int, int]) -> Survey:
    """Survey 3 x 3 tiles in this process, to separate the reads for iso-values and for windows."""
    source = chop_sample(folder, tile)
    out = folder / "survey"
    with counting(folder) as (address, sent):
        plan(f"{address}/{source.name}", out, (3, 3), tile, "0")
        settled = OutFolder(out).plan()
        (channel,) = settled.channels
        window = window_step(settled, channel).run()
        take(sent)
        for each in settled.tiles:
            step = evidence_step(settled, each.box, channel=channel, window=window)
            step.run()
        isos = take(sent)
    reach = denoising_reach(step.smoothing_um, settled.spacing_um, 0)
    z, y, x = (own + more for own, more in zip(reach, HALO, strict=True))
    region, chunk = settled.region, chunk_of(source)
    read = (each.box.grown((z, y, x), region) for each in settled.tiles)
    voxel = stored(source, region) / math.prod(region.shape)
    return Survey(
        isos / (voxel * sum(touched(box, chunk, region) for box in read)),
        isos / (voxel * sum(math.prod(each.box.shape) for each in settled.tiles)),
        (z, y, x),
    )


def measure_windows(folder: Path, source: Path) -> float:
    """Return the ratio of the bytes read for the display window of a tile of REAL to those needed.

    Needed are a coarse level, and the blocks in which edges are searched.
    """
    out = folder / "windows"
    with counting(folder) as (address, sent):
        plan(f"{address}/{source.name}", out, (1, 1), REAL, "0")
        settled = OutFolder(out).plan()
        take(sent)
        window_step(settled, settled.channels[0]).run()
        coarse = {Path(file) for file in sent if not file.startswith(f"{source / '0'}/")}
        read = take(sent)
    region = settled.region
    voxel = stored(source, region) / math.prod(region.shape)
    level = sum(file.stat().st_size for file in coarse if file.suffix != ".json")
    return read / (level + voxel * under_blocks(region, chunk_of(source)))


def chop_sample(folder: Path, tile: tuple[int, int, int]) -> Path:
    """Write a sample of 3 x 3 tiles, and return its path.

    Each tile has as many chunks as a tile of REAL has chunks of CHUNK.
    """
    path = folder / f"chopped_{'_'.join(map(str, tile))}.ome.zarr"
    if not path.exists():
        voxels: np.ndarray = zarr.open_array(make_sample(folder, (3, 3), tile) / "0")[:1]  # type: ignore
        made = folder / "half.ome.zarr"
        chunk = [max(1, n * c // real) for n, c, real in zip(tile, CHUNK, REAL, strict=True)]
        write_ome_zarr(made, [voxels], "czyx", chunks=(1, *chunk))
        made.rename(path)
    return path


def take(sent: dict[str, int]) -> int:
    """Return the bytes of voxels that were sent, and reset the count."""
    size = sum(size for file, size in sent.items() if not file.endswith(".json"))
    sent.clear()
    return size


def chunk_of(source: Path) -> tuple[int, ...]:
    return zarr.open_array(source / "0", mode="r").chunks[1:]


def stored(source: Path, box: Box) -> int:
    """Return the bytes of the first channel's chunks that a box touches."""
    array = zarr.open_array(source / "0", mode="r")
    along = [
        range(low // chunk, (high - 1) // chunk + 1)
        for low, high, chunk in zip(box.start, box.stop, array.chunks[1:], strict=True)
    ]
    places = itertools.product([0], *along)
    files = [source / "0" / array.metadata.encode_chunk_key(place) for place in places]
    return sum(file.stat().st_size for file in files if file.exists())  # zeros have no file


def touched(box: Box, chunk: tuple[int, ...], region: Box) -> int:
    """Return how many voxels of the region lie in chunks that a box touches."""
    ends = zip(box.start, box.stop, chunk, region.stop, strict=True)
    return math.prod(min(-(-high // c) * c, end) - low // c * c for low, high, c, end in ends)


def under_blocks(region: Box, chunk: tuple[int, ...]) -> int:
    """Return the number of voxels in the chunks of the blocks in which edges are searched."""
    blocks = [box.grown((1, 1, 1), region) for box in sample_boxes(region, JOINT_VOXELS)]
    return sum(touched(block, chunk, region) for block in blocks)


def print_reading(reading: Reading, survey: Survey, windows: float) -> None:
    print(f"Read by a unit: {reading.chunks:.2f} x the chunks that its window touches (bound "
          f"{MAX_READ}), {reading.window:.2f} x the window itself; by a command, to see that the "
          f"source is the same, {reading.check / 1e6:.1f} MB")  # fmt: skip
    print(f"Read for iso-values, tiles of four chunks' width: {survey.chunks:.2f} x the chunks "
          f"that they touch with halos (bound {MAX_READ}), {survey.tiles:.2f} x the tiles; for a "
          f"channel's window {windows:.2f} x the level and the blocks that it comes from "
          f"(bound {MAX_READ})")  # fmt: skip


def reading_rows(reading: Reading, survey: Survey, windows: float) -> list[list[str]]:
    """Return the rows of the published table that state reads.

    windows  ratio that measure_windows() returns
    """
    return [
        [
            "read by a unit",
            f"{reading.chunks:.2f} x the chunks that its window touches (bound {MAX_READ}); "
            f"{reading.window:.2f} x the window itself",
        ],
        [
            "read for iso-values, by tiles four chunks wide",
            f"{survey.chunks:.2f} x the chunks that the tiles touch with their halos "
            f"(bound {MAX_READ}), {survey.tiles:.2f} x the tiles",
        ],
        [
            f"read for the display window of a channel of {' x '.join(map(str, REAL))}",
            f"{windows:.2f} x the chunks that the voxels lie in (bound {MAX_READ})",
        ],
    ]


def print_whole(
    reading: Reading, survey: Survey, windows: float, voxel: float, halo: tuple[int, int, int]
) -> None:
    """Print the estimated reads of the dataset: counted chunks times measured ratios.

    windows  ratio that measure_windows() returns
    voxel    stored bytes of a voxel
    """
    tiles = cut(REGION, REAL)
    grown = [tile.lattice(REGION).grown(halo, REGION) for tile in tiles]
    own = sum(math.prod(window.shape) for window in grown)
    around = sum(touched(window, CHUNK, REGION) for window in grown)
    boxes = sum(touched(tile.box.grown(survey.halo, REGION), CHUNK, REGION) for tile in tiles)
    units, isos, displays = (
        CHANNELS * voxel * ratio * voxels
        for ratio, voxels in (
            (reading.chunks, around),
            (survey.chunks, boxes),
            (windows, SURVEY_VOXELS + under_blocks(REGION, CHUNK)),
        )
    )
    print(f"  {' x '.join(map(str, REGION.shape))} voxels, {voxel:.2f} bytes each as stored, in "
          f"chunks of {' x '.join(map(str, CHUNK))}; {CHANNELS} channels; {units / 1e12:.2f} TB "
          f"read by units ({around / own:.2f} x their windows), {isos / 1e12:.2f} TB for "
          f"iso-values ({boxes / math.prod(REGION.shape):.2f} x the dataset), "
          f"{displays / 1e12:.3f} TB for windows, where there are coarse levels")  # fmt: skip

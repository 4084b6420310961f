"""The passes over the voxels, from file to unit: iso-values, world positions, distances."""

import weakref
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista as pv
from numpy.typing import NDArray
from pxr import Usd

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.isosurface.level_evidence import TileEvidence
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.volume import zyx_to_xyz
from stereocell.steps.gather_evidence import GatherEvidence, evidence_from_json
from stereocell.steps.unit_files import load_lods
from support import phantoms
from support.exhaustive import sweep
from support.meshes import enclosed_volume

SPACING = (1.0, 1.0, 1.0)


def _units(source: Path, out: Path, *flags: str) -> OutFolder:
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    return OutFolder(out)


def _lods(out_folder: OutFolder) -> dict[str, tuple[Lod, ...]]:
    """Return the levels of detail of each unit, by `<tile>/<channel>`."""
    built = {}
    for unit, key in out_folder.index().items():
        built[unit] = load_lods(out_folder.unit_dir(unit, key))
    return built


# --- iso-values


@pytest.mark.slow
def test_the_command_holds_the_evidence_of_one_channel_at_a_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The evidence takes .4 MB for each unit, and a dataset has thousands of units."""
    shape = (16, 32, 32)
    field = phantoms.blurred_ball(shape, SPACING, (7.5, 15.5, 15.5), 6.0, 1.0)
    counts = phantoms.as_counts(np.tile(field, (1, 2, 2)), 100, 1100, noise=5.0)
    source = phantoms.write_ome_zarr(tmp_path / "six.ome.zarr", [np.stack(6 * [counts])], "czyx")
    made: list[weakref.ref[NDArray[np.int64]]] = []
    held = []

    def count(content: Mapping[str, Any]) -> TileEvidence:
        found = evidence_from_json(content)
        made.append(weakref.ref(found.differences))
        held.append(sum(each() is not None for each in made))
        return found

    monkeypatch.setattr(GatherEvidence, "FORM", replace(GatherEvidence.FORM, from_json=count))
    _units(source, tmp_path / "out", "--tile-size", "16,32,32")
    assert len(held) >= 6 * 4
    assert max(held) <= 2 * 4


@pytest.mark.slow
def test_each_tile_has_its_own_level_on_request(
    tmp_path: Path,
) -> None:
    """One value for both would make the dim ball a quarter too small, or the bright one large."""
    radius, shape = 8.0, (32, 32, 64)
    dim = phantoms.blurred_ball(shape, SPACING, (15.5, 15.5, 15.5), radius, 1.0)
    bright = phantoms.blurred_ball(shape, SPACING, (15.5, 15.5, 47.5), radius, 1.0)
    counts = phantoms.as_counts(dim + 2 * bright, 100, 1100, noise=5.0)
    source = phantoms.write_ome_tiff(tmp_path / "two.ome.tif", counts, spacing=SPACING)
    flags = ("--tile-size", "32,32,32", "--iso-scope", "tile")
    out_folder = _units(source, tmp_path / "out", *flags)
    for lods in _lods(out_folder).values():
        assert enclosed_volume(lods[0].mesh) == pytest.approx(4 / 3 * np.pi * radius**3, rel=0.12)


def _mixed_family() -> NDArray[np.uint16]:
    """Return 30 dim balls (400 on a background of 100) and 2 bright ones (1100), with noise."""
    shape = (36, 96, 96)
    steps = (12.0, 36.0, 60.0, 84.0)
    centers = [(z, y, x) for z in (9.0, 26.0) for y in steps for x in steps]
    field = np.zeros(shape, np.float32)
    for index, center in enumerate(centers):
        height = 1.0 if index in (5, 26) else 0.3
        field += height * phantoms.blurred_ball(shape, SPACING, center, 5.0, 1.0)
    return phantoms.as_counts(field, 100, 1100, noise=15.0)


@pytest.mark.slow
def test_a_few_bright_balls_do_not_hide_many_dim_ones(tmp_path: Path) -> None:
    """The mean gradient finds the brightest balls only, so it is not the default."""
    source = phantoms.write_ome_tiff(tmp_path / "mix.ome.tif", _mixed_family(), spacing=SPACING)
    (tmp_path / "mean.toml").write_text('[isovalue]\ncriterion = "pekar-mean"\n')
    found = []
    for name, flags in (("default", []), ("mean", ["--config", str(tmp_path / "mean.toml")])):
        out_folder = _units(source, tmp_path / name, "--tile-size", "36,96,96", *flags)
        (channel,) = out_folder.survey().values()
        iso = channel["iso"]["r0_c0"]
        found.append(iso["value"] + iso["background"])
    default, mean = found
    assert default == pytest.approx(250, rel=0.2)  # half-way between background and dim balls
    assert mean > 400  # above all dim balls


# --- places


CENTER, RADIUS = (22.3, 24.1, 20.7), 8.0
ORIGIN = (100.0, 200.0, 300.0)


def _pyramid(path: Path, skip: int, translations: tuple[dict[str, float] | None, ...]) -> Path:
    """Write a ball at two levels, the coarse one of means of 2 x 2 x 2 voxels from `skip` on."""
    ball = phantoms.blurred_ball((48, 48, 48), SPACING, CENTER, RADIUS, 1.2)
    fine = phantoms.as_counts(ball, 100, 1100)
    whole = fine[skip : 48 - skip, skip : 48 - skip, skip : 48 - skip]
    n = len(whole) // 2
    coarse = whole.reshape(n, 2, n, 2, n, 2).mean(axis=(1, 3, 5)).round().astype(np.uint16)
    scales = [dict.fromkeys("zyx", 1.0), dict.fromkeys("zyx", 2.0)]
    return phantoms.write_ome_zarr(path, [fine, coarse], scales=scales, translations=translations)


def _center_of(mesh: Mesh) -> NDArray[np.float64]:
    """Return the centre of mass (x, y, z) of the solid that a closed mesh encloses."""
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    sixths = (a * np.cross(b, c)).sum(axis=1)  # tetrahedra from the origin
    center: NDArray[np.float64] = sixths @ ((a + b + c) / 4) / sixths.sum()
    return center


FINE, COARSE = (["--level", level] for level in "01")
FINE_PART = ([*FINE, "--region", "7:44,5:46,3:42"], (7, 5, 3, 44, 46, 42))
COARSE_PART = ([*COARSE, "--region", "2:18,3:19,1:17"], (2, 3, 1, 18, 19, 17))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("flags", "region", "stated"),
    sweep(
        [
            (*place, stated)
            for place in ((FINE, (0, 0, 0, 48, 48, 48)), FINE_PART, (COARSE, None), COARSE_PART)
            for stated in (False, True)
        ],
        kept=[(*FINE_PART, False), (COARSE, None, False), (*COARSE_PART, True)],
    ),
)
def test_a_ball_has_the_right_position_at_any_level_and_in_any_region(
    tmp_path: Path, flags: list[str], region: tuple[int, ...] | None, stated: bool
) -> None:
    # voxel 0 of level 1 is the mean of level 0's first two, or begins later if the file states so
    skip = 4 if stated else 0
    level = int(flags[1])
    first = dict(zip("zyx", ORIGIN, strict=True))
    second = {axis: value + skip + 0.5 for axis, value in first.items()}
    translations = (first, second) if stated else (None, None)
    source = _pyramid(tmp_path / "ball.ome.zarr", skip, translations)
    out_folder = _units(source, tmp_path / "out", *flags)
    ((unit, lods),) = _lods(out_folder).items()
    spacing = 2.0**level
    np.testing.assert_allclose(_center_of(lods[0].mesh), zyx_to_xyz(CENTER), atol=0.05 * spacing)

    # the stage also states the positions of the volume's first and last lattice points
    assert main(["stage", str(out_folder.out), "--workers", "0"]) == 0
    n = (48 - 2 * skip) // 2 if level else 48
    box = np.reshape(region if region is not None else (0, 0, 0, n, n, n), (2, 3))
    origin = skip + 0.5 if level else 0.0
    ends = zyx_to_xyz(origin + spacing * (box - [[0], [1]]))
    stage = Usd.Stage.Open(str(out_folder.stage_file))
    tile, channel = unit.split("/")
    prim = stage.GetPrimAtPath(f"/Specimen/Tiles/{tile}/{channel}/{channel}_{tile}_volume")
    low, high = (prim.GetAttribute(f"stereocell:bounds{end}").Get() for end in ("Min", "Max"))
    np.testing.assert_allclose(low, ends.min(axis=0), atol=1e-6)
    np.testing.assert_allclose(high, ends.max(axis=0), atol=1e-6)


# --- distances


def _points_on(mesh: Mesh, count: int) -> pv.PolyData:
    """Return random points that are evenly distributed over the mesh's area."""
    rng = np.random.default_rng(0)
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = rng.choice(len(area), count, p=area / area.sum())
    weights = rng.dirichlet((1, 1, 1), count)
    corners = np.stack([a, b, c], axis=1)[chosen]
    return pv.PolyData((weights[:, :, None] * corners).sum(axis=1))


def _surface(mesh: Mesh) -> pv.PolyData:
    return pv.PolyData.from_regular_faces(mesh.positions, mesh.triangles.astype(np.int64))


@pytest.mark.slow
def test_99_percent_of_the_surface_lie_within_the_recorded_distance(
    tmp_path: Path,
) -> None:
    """The distance is compared at random points of both surfaces with VTK's implicit distance."""
    source = phantoms.write_ome_tiff(tmp_path / "f.ome.tif", phantoms.f_phantom(2), spacing=SPACING)
    (lods,) = _lods(_units(source, tmp_path / "out")).values()
    assert len(lods) == 4
    finest = lods[0].mesh
    for coarse in lods[1:]:
        ways = [
            np.abs(
                _points_on(here, 2000).compute_implicit_distance(_surface(there))[
                    "implicit_distance"
                ]
            )
            for here, there in ((finest, coarse.mesh), (coarse.mesh, finest))
        ]
        # the record compares with the surface before simplification, and lod0 is close to that
        slack = lods[0].distance_um
        assert max(np.percentile(way, 98) for way in ways) <= coarse.distance_um + slack
        assert max(way.max() for way in ways) >= coarse.distance_um - slack
        assert coarse.distance_um > 3 * slack

"""The page in one file has the finest levels that fit, and sends no request to any host."""

import base64
import gzip
import hashlib
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import pytest

from stereocell.cli.__main__ import main
from stereocell.engine.run import Engine
from stereocell.export.scene import write_scene
from stereocell.formats.tiles3d import TileLod, make_tilesets
from stereocell.formats.tiles3d_levels import inlined, surfaces, without_finer
from stereocell.model.errors import OutputError, UsageError
from support.bundles import load, write_bundle, write_tiles
from support.small_viewer import use_small_viewer

LINK = "https://host.example/page/?quality=low#v=1&c=CD31&eye=0,0,1.8,0,0,0"


@pytest.fixture(scope="session")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scene")
    stage = write_tiles(folder / "stage")
    write_bundle(stage, folder / "bundle", None, engine=Engine(0))
    return folder / "bundle"


@pytest.fixture(autouse=True)
def built_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A viewer of a few files, because a checkout may have no built viewer."""
    use_small_viewer(tmp_path / "dist", monkeypatch)


class Page(HTMLParser):
    """The unpacked blocks of a page, from the viewer and from the bundle, by name."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.blocks: dict[str, dict[str, bytes]] = {"page": {}, "file": {}}
        self.others: list[str] = []
        self._open: dict[str, str | None] = {}
        self.feed(file.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._open = dict(attrs) if tag == "script" else {}

    def handle_data(self, data: str) -> None:
        for kind, found in self.blocks.items():
            name = self._open.get(f"data-{kind}")
            if name is not None:
                packed = base64.b64decode(data, validate=True)
                assert len(packed) == int(self._open["data-bytes"] or "")
                is_packed = "data-packed" in self._open
                found[name] = gzip.decompress(packed) if is_packed else packed
        if "data-view" in self._open:
            self.others.append(data)
        self._open = {}

    def extract(self, folder: Path) -> Path:
        for name, content in self.blocks["file"].items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        return folder


def least_mb(bundle: Path, file: Path) -> float:
    with pytest.raises(
        UsageError, match=r"^--max-mb is 0\.001, expected at least [\d.]+, as the page"
    ) as e:
        write_scene(bundle, file, max_mb=0.001)
    found = re.search(r"expected at least ([\d.]+), as", str(e.value))
    assert found
    return float(found[1])


def test_page_with_enough_space_has_all_files_of_the_bundle(bundle: Path, tmp_path: Path) -> None:
    about = write_scene(bundle, tmp_path / "s.html")
    found = Page(tmp_path / "s.html").blocks
    assert "surfaces at lod0 and volumes at resolution level 0 (" in about
    assert "finer" not in about
    assert found["page"]["viewer-1.js"] == gzip.compress(b"plain", mtime=0)
    assert found["file"].pop("environments/sky.hdr") == b"light"
    changed = {"manifest.json", "files.json"}
    for name, content in found["file"].items():
        if name in changed or name.endswith(("volumes.json", "tileset.json")):
            continue
        assert content == (bundle / name).read_bytes(), name
    kept = {path for path in load(bundle / "files.json") if path != "specimen.usdz"}
    assert found["file"].keys() == kept | changed


@pytest.mark.parametrize("is_coarse", [False, True])
def test_the_bundle_in_a_page_passes_check(
    bundle: Path, tmp_path: Path, is_coarse: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    most = least_mb(bundle, tmp_path / "s.html") if is_coarse else 25
    write_scene(bundle, tmp_path / "s.html", max_mb=most)
    folder = Page(tmp_path / "s.html").extract(tmp_path / "bundle")
    (folder / "environments" / "sky.hdr").unlink()  # a file of the viewer
    assert main(["check", str(folder)]) == 0, capsys.readouterr().err


def test_the_coarsest_levels_are_those_of_the_bundle(bundle: Path, tmp_path: Path) -> None:
    most = least_mb(bundle, tmp_path / "s.html")
    about = write_scene(bundle, tmp_path / "s.html", max_mb=most)
    assert (tmp_path / "s.html").stat().st_size <= most * 1e6
    assert re.search(
        r"left out: \d finer levels? of detail, \d finer resolution levels? of volumes", about
    )
    files = Page(tmp_path / "s.html").blocks["file"]
    whole = load(bundle / "channels/CD31/volumes.json")["volumes"]
    for volume, before in zip(
        json.loads(files["channels/CD31/volumes.json"])["volumes"], whole, strict=True
    ):
        texture = files[volume["file"]["path"]]
        places = [(level["offset"], level["length"]) for level in volume["levels"]]
        frames = [hashlib.sha256(texture[at : at + n]).hexdigest() for at, n in places]
        hashes = [level["sha256"] for level in before["levels"]]
        assert 1 <= len(frames) < len(hashes)
        assert frames == hashes[-len(frames) :]
        assert volume["size"] == before["size"]  # bricks are counted in the full size
    left = {name for name in files if name.endswith(".glb")}
    assert left
    assert not {name for name in left if name.endswith("lod0.glb")}


def test_command_on_an_exported_scene_names_it_and_the_remedy(
    bundle: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_scene(bundle, tmp_path / "a.html")
    assert main(["publish", str(tmp_path / "a.html"), str(tmp_path / "site")]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "a scene in one file" in line
    assert "name the OUT that it was made from" in line


def test_the_same_bundle_makes_the_same_bytes(bundle: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_scene(bundle, tmp_path / f"{name}.html", max_mb=0.3)
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


def test_channels_are_taken_by_name_and_others_leave_no_file(bundle: Path, tmp_path: Path) -> None:
    with pytest.raises(
        UsageError, match="--channels names 'CD4', expected one or more of CD31, Hoechst 33342"
    ):
        write_scene(bundle, tmp_path / "s.html", channels=("CD4",))
    write_scene(bundle, tmp_path / "s.html", channels=("CD31",))
    files = Page(tmp_path / "s.html").blocks["file"]
    assert not [name for name in files if "Hoechst" in name]
    assert [one["name"] for one in json.loads(files["manifest.json"])["channels"]] == ["CD31"]


def test_a_damaged_file_of_the_bundle_is_refused(bundle: Path, tmp_path: Path) -> None:
    copy = tmp_path / "bundle"
    for file in bundle.rglob("*"):
        if file.is_file():
            (copy / file.relative_to(bundle)).parent.mkdir(parents=True, exist_ok=True)
            (copy / file.relative_to(bundle)).write_bytes(file.read_bytes())
    broken = copy / "luts" / "CD31.ktx2"
    broken.write_bytes(broken.read_bytes()[::-1])
    with pytest.raises(OutputError, match=r"CD31\.ktx2: its size or hash differs from files\.json"):
        write_scene(copy, tmp_path / "s.html")
    broken.unlink()
    with pytest.raises(OutputError, match=r"CD31\.ktx2: missing from the bundle, expected"):
        write_scene(copy, tmp_path / "s.html")
    assert not (tmp_path / "s.html").exists()


def test_a_link_is_the_view_and_another_text_is_refused(bundle: Path, tmp_path: Path) -> None:
    write_scene(bundle, tmp_path / "s.html", view=LINK)
    assert Page(tmp_path / "s.html").others == [LINK[LINK.index("#") :]]
    for text in ("front", "https://host.example/", "#v=1</script>", "#v=1&c=" + 20_000 * "x"):
        with pytest.raises(UsageError, match=r"--view is .*, expected a link from the viewer"):
            write_scene(bundle, tmp_path / "s.html", view=text)


def test_page_runs_only_its_own_script_and_reaches_no_host(bundle: Path, tmp_path: Path) -> None:
    write_scene(bundle, tmp_path / "s.html")
    text = (tmp_path / "s.html").read_text("utf-8")
    (script,) = re.findall(r"<script>(.*?)</script>", text, re.S)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    assert policy
    assert f"'sha256-{digest}'" in policy[1]
    assert "default-src 'none'" in policy[1]
    assert "connect-src data: blob:;" in policy[1]
    assert not re.search(r"http|'self'|unsafe-inline|\*", policy[1])


def test_options_of_other_formats_are_refused(
    bundle: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = bundle.parent
    for words, expected in (
        (["--lod", "1"], "--lod does not apply to .html, expected a file that ends in one of .glb"),
        (
            ["--stage", str(out / "stage" / "stage.usda")],
            "--stage does not apply to .html, which holds",
        ),
    ):
        assert main(["export", str(out), str(tmp_path / "s.html"), *words]) == 2
        assert expected in capsys.readouterr().err
    assert main(["export", str(out), str(tmp_path / "s.glb"), "--max-mb", "3"]) == 2
    assert (
        "--max-mb does not apply to .glb, expected a file that ends in one of .html"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize("count", [3, 70])
def test_levels_are_taken_out_of_tilesets_of_few_and_of_many_tiles(count: int) -> None:
    """If there are many tiles, each has its own tileset for its finer levels."""
    corner = SimpleNamespace(low=(0.0, 0.0, 0.0), high=(1e-3, 1e-3, 1e-3))
    tiles = [
        [
            TileLod(f"t{tile}/lod{lod}.glb", f"{lod:064x}", float(lod), corner.low, corner.high)
            for lod in range(4 if tile else 1)
        ]
        for tile in range(count)
    ]
    files = {name: json.loads(content) for name, content in make_tilesets(tiles).items()}
    assert (len(files) > 1) == (count > 64)
    root = inlined(files["tileset.json"]["root"], lambda uri: files[uri]["root"])
    every = {(lod.uri, int(lod.uri[-5])) for lods in tiles for lod in lods}
    assert set(surfaces(root)) == every
    cut = without_finer(root, 2)
    # The only level of the first tile stays.
    assert set(surfaces(cut)) == {one for one in every if one[1] >= 2 or one[0] == "t0/lod0.glb"}

"""What the docs show works as they show it."""

import re
from pathlib import Path

import pytest

import phantoms

DOCS = Path(__file__).parents[1] / "docs"


@pytest.mark.slow
def test_python_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    phantoms.write_ome_tiff(tmp_path / "my.ome.tif", phantoms.f_phantom()[None], "CZYX")
    text = (DOCS / "python.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(blocks) == 3
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), names)
    assert (tmp_path / "out" / "mine" / "bundle" / "manifest.json").is_file()


def test_functions_that_are_named_exist() -> None:
    from importlib import import_module

    text = (DOCS / "python.md").read_text()
    named = re.findall(r"`([a-z][\w.]*)\.(\w+)`", text.partition("| step |")[2])
    assert len(named) > 12
    for module, function in named:
        assert callable(getattr(import_module(f"stereocell.{module}"), function))


def test_links_between_documents_lead_somewhere() -> None:
    root = DOCS.parent
    for document in (root / "README.md", *DOCS.glob("*.md")):
        for target in re.findall(r"\]\(([^)#]+)[^)]*\)", document.read_text()):
            if "://" not in target:
                assert (document.parent / target).exists(), f"{document.name}: {target}"

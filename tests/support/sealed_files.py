"""Edits of sealed JSON that give it the hash of its new content, as a forger would."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any


def seal(content: dict[str, Any]) -> dict[str, Any]:
    """Return the content with the hash of its present values."""
    others = {name: value for name, value in content.items() if name != "sha256"}
    digest = hashlib.sha256(json.dumps(others, sort_keys=True).encode()).hexdigest()
    return {**others, "sha256": digest}


def edit_sealed(file: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Change the content of a file in place, and seal it again."""
    content = json.loads(file.read_bytes())
    change(content)
    file.write_text(json.dumps(seal(content), indent=1) + "\n")

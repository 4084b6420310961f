"""Make pages of the documentation from the program itself, as a hook of MkDocs.

The formats come from schemas/, the commands from their parser, and the settings from their
defaults. The notebook is run, so that its page shows the results of this version.
"""

import argparse
import base64
import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
NOTEBOOK = "notebook.ipynb"

# Title, schema and description of the page of each format, by the page's name
FORMATS: dict[str, tuple[str, str, str]] = {
    "plan": (
        "Plan",
        "plan",
        "`OUT/plan.json`. See [Your own data](../own-data.md).",
    ),
    "units": (
        "Units",
        "units",
        "Files of `OUT` and `OUT/units/` that one phase writes for the next, and "
        "`OUT/stage/files.json`.",
    ),
    "bundle": ("Bundle", "bundle", "`OUT/bundle/manifest.json` and `files.json`."),
    "volumes": ("Bundle: volumes", "volumes", "`OUT/bundle/channels/<channel>/volumes.json`."),
    "objects": (
        "Bundle: objects",
        "objects",
        "`OUT/bundle/channels/<channel>/objects.json`, of a label map: "
        "[Objects in stage and bundle](../objects-format.md).",
    ),
    "transfer2d": (
        "Bundle: transfer functions",
        "transfer2d",
        "`OUT/bundle/channels/<channel>/transfer2d.json`. How a table is made of the shapes: "
        "[Tables of two-dimensional transfer functions](../transfer-tables.md).",
    ),
    "brick-stream": (
        "Brick stream",
        "brick_stream",
        "Messages and bytes of the websocket `/bricks`. Their order and what they are for: "
        "[Bricks by view](../brick-stream.md).",
    ),
    "tissue": (
        "Tissue",
        "tissue",
        "`OUT/tissue/tissue.json`. See [Tissue classes](../tissue.md).",
    ),
    "slices": (
        "Slices",
        "slices",
        "`slices.json`, beside the PNG files that `stereocell slices` writes: "
        "[Slices as PNG](../slices.md).",
    ),
    "inbox": ("Inbox", "inbox", "`FOLDER/inbox.json`. See [The inbox](../inbox.md)."),
}
_ANCHOR = re.compile(r"#/\$defs/(\w+)")
_OTHER_SCHEMA = re.compile(r"urn:stereocell:schema:(\w+):1#/([$\w]+)/")


def pages() -> dict[str, str]:
    """Return the Markdown of every generated page except the notebook's, by its path."""
    made = {f"formats/{page}.md": format_page(*about) for page, about in FORMATS.items()}
    return made | {
        "formats/stage.md": stage_page(),
        "commands.md": commands_page(),
        "settings.md": settings_page(),
    }


# Links to generated pages

# A page in the repository can't link to a page that only the site has. It links to a line of
# reference.md instead, and the hook replaces this link with a link to the page itself.
TARGETS = {
    **{name: f"formats/{name}.md" for name in FORMATS},
    "stage": "formats/stage.md",
    "commands": "commands.md",
    "settings": "settings.md",
    "notebook": "notebook.md",
}
_LINK = re.compile(r"\]\((?:\.\./)*reference\.md#([\w-]+)\)")


def with_made_pages(markdown: str, path: str) -> str:
    """Return a page whose links lead to generated pages instead of lines of reference.md.

    path  path of the page below docs/, such as `formats/index.md`
    """
    up = "../" * path.count("/")
    return _LINK.sub(lambda link: f"]({up}{TARGETS[link[1]]})", markdown)


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Replace the links of a page; MkDocs calls this."""
    return with_made_pages(markdown, page.file.src_uri)


# JSON Schemas


def format_page(title: str, schema: str, about: str) -> str:
    """Return the page of one JSON Schema: a table of fields for each object in it."""
    content = json.loads((ROOT / "schemas" / f"{schema}.schema.json").read_bytes())
    parts = [f"# {title}", about, content["description"]]
    parts.append(f"Made from `schemas/{schema}.schema.json`. Fields in italics may be left out.")
    defs: Mapping[str, Any] = content.get("$defs", {})
    if "properties" in content:
        parts += ["## The file", _table(content, defs)]
    for name, one in defs.items():
        parts += [f"## {name}", one.get("description", "")]
        rows = list(_rows(one, "", defs))
        parts.append(_table(one, defs) if rows else _type(one))
    for name, layout in content.get("x-layout", {}).items():
        parts += [f"## Bytes: {name}", _layout(layout)]
    return "\n\n".join(part for part in parts if part) + "\n"


def _table(schema: Mapping[str, Any], defs: Mapping[str, Any]) -> str:
    lines = ["| field | type | meaning |", "|---|---|---|"]
    for name, is_required, field in _rows(schema, "", defs):
        shown = f"`{name}`" if is_required else f"*`{name}`*"
        lines.append(f"| {shown} | {_type(field)} | {_meaning(field, defs)} |")
    return "\n".join(lines)


def _rows(
    schema: Mapping[str, Any], prefix: str, defs: Mapping[str, Any]
) -> Iterator[tuple[str, bool, Mapping[str, Any]]]:
    """Yield each field, also of nested objects: its name, whether it is required, its schema."""
    required = schema.get("required", ())
    for name, field in schema.get("properties", {}).items():
        yield prefix + name, name in required, field
        yield from _rows(field, f"{prefix}{name}.", defs)
    for key, mark in (("items", "[]"), ("additionalProperties", "*")):
        inner = schema.get(key)
        if isinstance(inner, Mapping):
            if key == "additionalProperties":
                yield f"{prefix}{mark}", True, inner
            name = prefix.removesuffix(".") + mark if key == "items" else prefix + mark
            yield from _rows(inner, f"{name}.", defs)


def _type(schema: Mapping[str, Any]) -> str:
    """Return a field's type in words."""
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[-1]
        if (other := _OTHER_SCHEMA.match(schema["$ref"])) is None:
            return f"[{name}](#{name.lower()})"
        page = next(page for page, (_, own, _) in FORMATS.items() if own == other[1])
        return f"[{name}]({page}.md#{name.lower() if other[2] == '$defs' else 'the-file'})"
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    if "enum" in schema:
        return ", ".join(f"`{value}`" for value in schema["enum"])
    for key in ("anyOf", "oneOf"):
        if key in schema:
            return " or ".join(_type(one) for one in schema[key])
    kinds = schema.get("type", "any")
    words = [_kind(kind, schema) for kind in ([kinds] if isinstance(kinds, str) else kinds)]
    usd = f" (USD `{schema['usdType']}`)" if "usdType" in schema else ""
    return " or ".join(words) + usd


def _kind(kind: str, schema: Mapping[str, Any]) -> str:
    if kind == "array":
        least, most = schema.get("minItems"), schema.get("maxItems")
        items: Mapping[str, Any] = schema.get("items") or next(
            iter(schema.get("prefixItems", ())), {}
        )
        inner = _type(items) if items else "any"
        if least is not None and least == most:
            return f"{least} x {inner}"
        return f"list of {inner}" + (f", at most {most}" if most else "")
    if kind == "object" and isinstance(schema.get("additionalProperties"), Mapping):
        return "object by name"
    if kind == "string" and "pattern" in schema:
        pattern = schema["pattern"].replace("|", "&#124;").replace("<", "&lt;")
        return f"string, <code>{pattern}</code>"
    return kind + _range(schema)


def _range(schema: Mapping[str, Any]) -> str:
    low, high = schema.get("minimum"), schema.get("maximum")
    if low is not None and high is not None:
        return f", {low} to {high}"
    if low is not None:
        return f", at least {low}"
    if high is not None:
        return f", at most {high}"
    return f", above {schema['exclusiveMinimum']}" if "exclusiveMinimum" in schema else ""


def _meaning(field: Mapping[str, Any], defs: Mapping[str, Any]) -> str:
    text = field.get("description", "")
    found = _ANCHOR.fullmatch(field.get("$ref", ""))
    if not text and found:
        text = defs[found[1]].get("description", "")
    return _cell(text)


def _cell(text: str) -> str:
    """Return prose as one line for a cell of a table, with markup characters escaped."""
    return " ".join(text.split()).replace("|", "&#124;").replace("<", "&lt;").replace("*", "&#42;")


def _layout(layout: Any) -> str:
    """Return the table of a binary layout, or its JSON if the layout does not list fields."""
    if not isinstance(layout, Mapping) or "fields" not in layout:
        return f"```json\n{json.dumps(layout, indent=2)}\n```"
    lines = ["| offset | field | type | value |", "|---|---|---|---|"]
    for field in layout["fields"]:
        count = f" x {field['count']}" if "count" in field else ""
        value = f"`{field['value']}`" if "value" in field else _cell(field.get("description", ""))
        lines.append(
            f"| {field['offset']} | `{field['name']}` | {field['type']}{count} | {value} |"
        )
    rest = {key: value for key, value in layout.items() if key != "fields"}
    return "\n".join([", ".join(f"{key}: {value}" for key, value in rest.items()), "", *lines])


# The stage's schema, commands, settings


def stage_page() -> str:
    """Return the page of the USD schemas of a stage's prims."""
    from pxr import Sdf

    layer = Sdf.Layer.FindOrOpen(str(ROOT / "schemas" / "usd" / "schema.usda"))
    parts = [
        "# Stage",
        "`OUT/stage/stage.usda` is USD: coordinates in micrometres (`metersPerUnit` 1e-6), Y up, "
        "`/Specimen/Tiles/<tile>` with variants of detail and representation, "
        "`/Specimen/Channels/<channel>` with each channel's look, `/Specimen/Cameras`. "
        "[The stage](../stage.md) says how to edit it. Attributes beyond USD's own belong to "
        "applied schemas, which `schemas/usd/schema.usda` defines. The channel's schema has a twin "
        "as JSON Schema, `schemas/channel.schema.json`.",
    ]
    for prim in layer.rootPrims:
        if not prim.attributes:
            continue
        lines = ["| attribute | type | default | meaning |", "|---|---|---|---|"]
        for one in prim.attributes:
            default = "" if one.default is None else f"`{json.dumps(_plain(one.default))}`"
            lines.append(
                f"| `{one.name}` | `{one.typeName}` | {default} | {_cell(one.documentation)} |"
            )
        parts += [f"## {prim.name}", " ".join(prim.documentation.split()), "\n".join(lines)]
    return "\n\n".join(parts) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, str | bool):
        return value
    try:
        return [round(float(one), 6) for one in value]
    except TypeError:
        return round(float(value), 6)


def commands_page() -> str:
    """Return the page with the help of every command."""
    from stereocell.cli import __main__ as cli

    (commands,) = (
        action.choices
        for action in cli._parser()._actions
        if isinstance(action, argparse._SubParsersAction)
    )
    parts = ["# Commands", "This page has the text that `stereocell COMMAND --help` prints."]
    for name, parser in commands.items():
        parser.formatter_class = lambda prog: argparse.RawDescriptionHelpFormatter(prog, width=96)
        parts += [f"## {name}", f"```text\n{parser.format_help()}```"]
    return "\n\n".join([*parts, f"```text\n{cli.EXIT_CODES}\n```"]) + "\n"


def settings_page() -> str:
    """Return the page of all settings, with the settings that each preset changes."""
    from stereocell.planning import settings as settings_module

    parts = [
        "# Settings",
        "This page has the text that `stereocell settings` prints. A file of these, or of some of "
        "them, goes to `--config`; flags go before the file, and the file before the preset.",
        "```toml\n"
        + settings_module.to_toml(settings_module.Settings(), header=settings_module.TEMPLATE)
        + "```",
    ]
    for path in sorted(settings_module.PRESETS.glob("*.toml")):
        parts += [f"## Preset {path.stem}", f"```toml\n{path.read_text()}```"]
    return "\n\n".join(parts) + "\n"


# The notebook


def run_notebook(path: Path) -> tuple[str, dict[str, bytes]]:
    """Run a notebook; return its Markdown, and its images by name.

    Raises nbclient's CellExecutionError if a cell fails.
    """
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(notebook, timeout=300, kernel_name="python3")
    client.extra_arguments = ["--IPKernelApp.log_level=ERROR"]
    client.execute(cwd=str(path.parent))
    parts: list[str] = []
    pictures: dict[str, bytes] = {}
    for cell in notebook.cells:
        if cell.cell_type != "code":
            parts.append(cell.source)
            continue
        parts.append(f"```python\n{cell.source}\n```")
        if printed := "".join(output.get("text", "") for output in cell.outputs):
            parts.append(f"```text\n{printed.rstrip()}\n```")
        for output in cell.outputs:
            if "image/png" in (data := output.get("data", {})):
                name = f"{path.stem}-{len(pictures)}.png"
                pictures[name] = base64.b64decode(data["image/png"])
                parts.append(f"![]({name})")
    return "\n\n".join(parts) + "\n", pictures


def on_files(files: Any, config: Any) -> Any:
    """Add the generated pages to the written ones; MkDocs calls this."""
    from mkdocs.structure.files import File

    notebook, pictures = run_notebook(Path(config.docs_dir) / NOTEBOOK)
    for path, text in (pages() | {"notebook.md": notebook}).items():
        files.append(File.generated(config, path, content=text))
    for path, content in pictures.items():
        files.append(File.generated(config, path, content=content))
    return files

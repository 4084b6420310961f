"""A contact sheet: one row per sample, one column per program and file, with the measures."""

from collections.abc import Mapping
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from support.dcc.pictures import Picture

BACKDROP = (11, 13, 18)  # the viewer's background
_MARGIN = (32, 34, 40)
_WIDTH = 480  # pixels, width of a picture
_LINE = 14  # pixels, height of a line of text
_COLUMNS = 4  # pictures side by side


def write_sheet(file: Path, samples: Mapping[str, Mapping[str, Picture]]) -> None:
    """Write a sheet of the pictures of each sample, by column."""
    every = [picture for row in samples.values() for picture in row.values()]
    rows_of, columns_of = every[0].drawn.shape
    height = round(rows_of * _WIDTH / columns_of)
    step = height + 4 * _LINE
    rows = sum(-(-len(row) // _COLUMNS) for row in samples.values())
    sheet = Image.new("RGB", (_WIDTH * _COLUMNS, step * rows), _MARGIN)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(11)
    top = 0
    for sample, row in samples.items():
        for number, (column, picture) in enumerate(row.items()):
            x, y = number % _COLUMNS * _WIDTH, top + number // _COLUMNS * step
            sheet.paste(_over_backdrop(picture.file).resize((_WIDTH, height)), (x, y))
            lines = "\n".join([f"{sample}: {column}", *picture.caption])
            draw.multiline_text((x + 4, y + height + 2), lines, "white", font, spacing=2)
        top += -(-len(row) // _COLUMNS) * step
    file.parent.mkdir(parents=True, exist_ok=True)
    sheet.save(file)


def _over_backdrop(file: Path) -> Image.Image:
    with Image.open(file) as opened:
        image = opened.convert("RGBA")
    return Image.alpha_composite(Image.new("RGBA", image.size, (*BACKDROP, 255)), image).convert(
        "RGB"
    )

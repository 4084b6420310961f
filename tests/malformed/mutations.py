"""Small changes of files, by seeds: a seed gives the same bytes each time.

Only truncations, and edits of text files, change a file's length. Each kind stands for one cause of
damage:
- a bit of memory or of a disk flips
- a copy stops
- a sector is lost
- blocks are written in the wrong place
- another program writes a field wrongly
"""

import random
import re
from collections.abc import Callable
from pathlib import Path

Chance = random.Random
_HEAD = 1500  # first bytes of a file, in which most headers lie
TEXTS = (".json", ".xml", ".mhd", ".zattrs", ".zarray", ".zgroup", ".csv")
_NUMBER = re.compile(rb"\d+(?:\.\d+)?")
_WORDS = (b"0", b"-1", b"1e999", b"nan", b"9" * 400, b"999999999999", b"2.5", b'"x"', b"null", b"")


def mutate(file: Path, content: bytes, chance: Chance) -> bytes:
    """Return the changed content of a file; the kind of change is random, too."""
    kinds: list[Callable[[bytes, Chance], bytes]] = [*KINDS.values()]
    if file.name.endswith(TEXTS):
        kinds += [_edit_text] * len(kinds)
    return chance.choice(kinds)(content, chance)


def _flip_bit(content: bytes, chance: Chance) -> bytes:
    return _flipped(content, chance.randrange(len(content)), chance)


def _flip_bit_of_head(content: bytes, chance: Chance) -> bytes:
    return _flipped(content, chance.randrange(min(_HEAD, len(content))), chance)


def _flip_bit_of_tail(content: bytes, chance: Chance) -> bytes:
    return _flipped(content, len(content) - 1 - chance.randrange(min(_HEAD, len(content))), chance)


def _flipped(content: bytes, place: int, chance: Chance) -> bytes:
    changed = bytearray(content)
    changed[place] ^= 1 << chance.randrange(8)
    return bytes(changed)


def _truncate(content: bytes, chance: Chance) -> bytes:
    return content[: chance.randrange(len(content))]


def _zero_sector(content: bytes, chance: Chance) -> bytes:
    size = chance.choice((16, 64, 512))
    start = size * chance.randrange(-(-len(content) // size))
    rest = content[start + size :]
    return content[:start] + bytes(len(content) - start - len(rest)) + rest


def _swap_blocks(content: bytes, chance: Chance) -> bytes:
    size = min(chance.choice((16, 64, 512)), len(content) // 2)
    first, second = sorted(chance.sample(range(len(content) // size), 2))
    changed = bytearray(content)
    a, b = (slice(size * place, size * (place + 1)) for place in (first, second))
    changed[a], changed[b] = content[b], content[a]
    return bytes(changed)


def _set_field(content: bytes, chance: Chance) -> bytes:
    """Set a binary number in the first bytes to an extreme."""
    size = chance.choice((1, 2, 4, 8))
    place = size * chance.randrange(max(min(_HEAD, len(content)) // size, 1))
    value = chance.choice((b"\0" * size, b"\xff" * size, b"\xff" * (size - 1) + b"\x7f"))
    return (content[:place] + value + content[place + size :])[: len(content)]


def _set_digits(content: bytes, chance: Chance) -> bytes:
    """Replace a number in digits by another one of the same length."""
    found = list(_NUMBER.finditer(content))
    if not found:
        return _flip_bit(content, chance)
    number = chance.choice(found)
    digits = bytes(chance.choice(b"0123456789") if chr(old).isdigit() else old for old in number[0])
    return content[: number.start()] + digits + content[number.end() :]


def _edit_text(content: bytes, chance: Chance) -> bytes:
    """Replace a number in a text by another word, of any length."""
    found = list(_NUMBER.finditer(content))
    if not found:
        return _flip_bit(content, chance)
    number = chance.choice(found)
    return content[: number.start()] + chance.choice(_WORDS) + content[number.end() :]


KINDS: dict[str, Callable[[bytes, Chance], bytes]] = {
    "a bit flipped": _flip_bit,
    "a bit of the head flipped": _flip_bit_of_head,
    "a bit of the tail flipped": _flip_bit_of_tail,
    "cut short": _truncate,
    "a sector of zeros": _zero_sector,
    "two blocks swapped": _swap_blocks,
    "a field of the head set": _set_field,
    "digits replaced": _set_digits,
}

"""Compress short blocks of 16-bit numbers, each as a zlib stream of its own.

A general encoder clears its tables for each stream, which takes longer than to compress 1 kB. The
table here that finds earlier pairs of numbers is never cleared: it holds positions in the whole
array, and positions before a block count as empty. Repeats are searched in whole numbers, whose
bytes then lie alike. The streams have the same bytes on every processor.

A block has at most 2 * MAX_NUMBERS + 1 symbols. So few symbols never need a Huffman code of more
than 13 bits, as a code of 14 bits needs at least 1363. The format allows 15.

References
----------
P. Deutsch (1996). RFC 1950 and RFC 1951: ZLIB and DEFLATE Compressed Data Format Specification.
A. Moffat & J. Katajainen (1995). In-place calculation of minimum-redundancy codes. Algorithms and
Data Structures, LNCS 955. doi:10.1007/3-540-60220-8_79
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import step

MAX_NUMBERS = 512  # numbers in a block
MAX_BYTES = 4096  # more bytes than any stream has
_LONGEST = 129  # numbers in the longest repeat, 258 bytes
_HASH_BITS, _HASH_FACTOR = 14, 0x9E3779B1  # for pairs of numbers
_OFTEN = 32  # symbols with at least this count are sorted one by one
_ADLER = 65521

# Symbols: bytes, the end of a block, and lengths of repeats; then distances of repeats
_END, _LENGTHS, _LITERALS, _SYMBOLS = 256, 257, 286, 316
# A token is a number, or a repeat: this bit, the distance in bytes, and 9 bits of length in bytes
_IS_REPEAT, _LENGTH_BITS = 1 << 20, 9
_LENGTH_MASK = (1 << _LENGTH_BITS) - 1

# RFC 1951, 3.2.5: the least length or distance of a symbol, and the number of bits after it
_LENGTH_MORE = np.array([0] * 8 + [n for n in range(1, 6) for _ in range(4)] + [0], np.int64)
_LENGTH_LEAST = 3 + np.cumsum(1 << _LENGTH_MORE) - (1 << _LENGTH_MORE)
_LENGTH_LEAST[28] = 258
_LENGTH_SYMBOL = np.searchsorted(_LENGTH_LEAST, np.arange(259), side="right") - 1
_DISTANCE_MORE = np.array([0, 0, *(k // 2 for k in range(28))], np.int64)
_DISTANCE_LEAST = 1 + np.cumsum(1 << _DISTANCE_MORE) - (1 << _DISTANCE_MORE)
_DISTANCE_SYMBOL = np.searchsorted(_DISTANCE_LEAST, np.arange(1025), side="right") - 1

# RFC 1951, 3.2.7: the lengths of codes are themselves coded, in this order of their codes. Bits of
# each code: tuned on three stains, 16-bit data, seen in 8 bits; other data takes a few bytes more.
_LIST_ORDER = np.array([16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15])
_LIST_BITS = np.array([3, 7, 7, 4, 3, 3, 3, 3, 4, 4, 5, 7, 7, 7, 7, 7, 7, 4, 5], np.int64)

Place = tuple[Any, Any, Any]  # bits that wait, their number, and the word that they will fill


@step
def _reversed_bits(code: int, bits: int) -> int:
    """Return a code with its first bit lowest, as the format stores codes."""
    code = (code & 0x5555) << 1 | code >> 1 & 0x5555
    code = (code & 0x3333) << 2 | code >> 2 & 0x3333
    code = (code & 0x0F0F) << 4 | code >> 4 & 0x0F0F
    return ((code & 0xFF) << 8 | code >> 8) >> (16 - bits)


def _list_codes() -> NDArray[np.int64]:
    codes, code = np.zeros(len(_LIST_BITS), np.int64), 0
    for bits in range(1, 8):
        code <<= 1
        for symbol in np.flatnonzero(bits == _LIST_BITS):
            codes[symbol] = _reversed_bits(code, bits)
            code += 1
    return codes


_LIST_CODES = _list_codes()


class Space(NamedTuple):
    """Arrays of the encoder.

    last     for each hash, the position of the last pair of numbers that has it
    tokens   numbers and repeats of a block
    counts   how often each symbol occurs in the block
    lengths  number of bits of each symbol's code; 0: it has none
    entries  32 times each symbol's code, plus its number of bits
    order    symbols by count
    weights  values by symbol or by count, while codes are made
    words    the stream, as 32-bit words and as bytes
    """

    last: NDArray[np.int64]
    tokens: NDArray[np.int64]
    counts: NDArray[np.int64]
    lengths: NDArray[np.int64]
    entries: NDArray[np.int64]
    order: NDArray[np.int64]
    weights: NDArray[np.int64]
    words: NDArray[np.uint32]
    bytes: NDArray[np.uint8]


def make_space() -> Space:
    """Return new arrays. An array of numbers needs its own, since `last` refers to positions."""
    words = np.zeros(MAX_BYTES // 4, np.uint32)
    return Space(
        np.full(1 << _HASH_BITS, -1, np.int64),
        np.zeros(MAX_NUMBERS, np.int64),
        np.zeros(_SYMBOLS, np.int64),
        np.zeros(_SYMBOLS, np.int64),
        np.zeros(_SYMBOLS, np.int64),
        np.zeros(_SYMBOLS, np.int64),
        np.zeros(_SYMBOLS, np.int64),
        words,
        words.view(np.uint8),
    )


@step
def write_stream(
    numbers: NDArray[np.uint16], start: int, end: int, space: Space, out: NDArray[np.uint8], at: int
) -> int:
    """Write numbers[start:end], a block, as a stream at out[at:], and return where it ends."""
    tokens = _find_tokens(numbers, start, end, space)
    for first, stop in ((0, _LITERALS), (_LITERALS, _SYMBOLS)):
        _find_lengths(space, first, stop)
        _find_codes(space, first, stop)
    head = _write_head(space, (np.uint64(0x0178), 16, 0))  # the head of zlib, then the block's
    pending, count, word = _write_tokens(space, head, tokens)
    space.words[word] = pending & np.uint64(0xFFFFFFFF)
    size = 4 * word + (count + 7) // 8
    for k in range(size):
        out[at + k] = space.bytes[k]
    low, high = _adler32(numbers, start, end)
    for k, byte in enumerate((high >> 8, high & 255, low >> 8, low & 255)):
        out[at + size + k] = byte
    return at + size + 4


@step
def _find_tokens(numbers: NDArray[np.uint16], start: int, end: int, space: Space) -> int:
    """Find the repeats of a block, count its symbols, and return the number of tokens."""
    last, tokens, counts = space.last, space.tokens, space.counts
    counts[:] = 0
    counts[_END] = 1
    count, i = 0, start
    while i < end:
        length, found = 0, -1
        if i + 1 < end:
            found = _replace_last(numbers, i, last)
            if found >= start:
                most = min(end - i, _LONGEST)
                while length < most and numbers[found + length] == numbers[i + length]:
                    length += 1
        if length < 2:  # the format has no repeats of two bytes
            tokens[count] = number = np.int64(numbers[i])
            counts[number & 255] += 1
            counts[number >> 8] += 1
            i += 1
            count += 1
            continue
        distance = 2 * (i - found)
        tokens[count] = _IS_REPEAT | distance << _LENGTH_BITS | 2 * length
        counts[_LENGTHS + _LENGTH_SYMBOL[2 * length]] += 1
        counts[_LITERALS + _DISTANCE_SYMBOL[distance]] += 1
        for k in range(i + 1, min(i + length, end - 1)):
            _replace_last(numbers, k, last)
        i += length
        count += 1
    return count


@step
def _replace_last(numbers: NDArray[np.uint16], at: int, last: NDArray[np.int64]) -> int:
    """Return the last position with the same hash of two numbers, and replace it by `at`."""
    pair = np.int64(numbers[at]) | np.int64(numbers[at + 1]) << 16
    key = (pair * _HASH_FACTOR & 0xFFFFFFFF) >> (32 - _HASH_BITS)
    found = last[key]
    last[key] = at
    return found


@step
def _adler32(numbers: NDArray[np.uint16], start: int, end: int) -> tuple[Any, Any]:
    """Return the two sums of Adler-32. The sums of a block are small, so one division is enough."""
    low, high, after = np.int64(1), np.int64(2 * (end - start)), np.int64(2 * (end - start))
    for i in range(start, end):
        first, second = np.int64(numbers[i]) & 255, np.int64(numbers[i]) >> 8
        low += first + second
        high += after * first + (after - 1) * second
        after -= 2
    return low % _ADLER, high % _ADLER


@step
def _sort_symbols(space: Space, first: int, stop: int) -> int:
    """Sort the symbols from `first` to `stop` that occur by their counts; return their number."""
    counts, order, places = space.counts, space.order, space.weights
    places[: _OFTEN + 1] = 0
    for symbol in range(first, stop):
        places[min(counts[symbol], _OFTEN)] += 1
    n = 0
    for count in range(1, _OFTEN + 1):
        places[count], n = n, n + places[count]
    often = places[_OFTEN]
    for symbol in range(first, stop):
        count = min(counts[symbol], _OFTEN)
        if count:
            order[places[count]] = symbol
            places[count] += 1
    for k in range(often + 1, n):  # only the frequent symbols are not in order yet
        symbol, place = order[k], k
        while place > often and counts[order[place - 1]] > counts[symbol]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = symbol
    return n


@step
def _find_lengths(space: Space, first: int, stop: int) -> None:
    """Find the lengths of the Huffman codes of the symbols from `first` to `stop`.

    The names and the three passes over `weights` are those of Moffat & Katajainen.
    """
    lengths, order, weights = space.lengths, space.order, space.weights
    n = _sort_symbols(space, first, stop)
    lengths[first:stop] = 0
    if n < 2:
        if n:
            lengths[order[0]] = 1
        return
    for k in range(n):
        weights[k] = space.counts[order[k]]
    # From left to right: weights of leaves become parents of inner nodes.
    leaf, root = 0, 0
    for node in range(n - 1):
        total = 0
        for _ in range(2):
            if leaf >= n or (root < node and weights[root] < weights[leaf]):
                total += weights[root]
                weights[root] = node
                root += 1
            else:
                total += weights[leaf]
                leaf += 1
        weights[node] = total
    # From right to left: parents become depths of inner nodes.
    weights[n - 2] = 0
    for node in range(n - 3, -1, -1):
        weights[node] = weights[weights[node]] + 1
    # From right to left: depths of inner nodes become depths of leaves.
    available, depth, root, leaf = 1, 0, n - 2, n - 1
    while available > 0:
        used = 0
        while root >= 0 and weights[root] == depth:
            used += 1
            root -= 1
        while available > used:
            lengths[order[leaf]] = depth
            leaf -= 1
            available -= 1
        available, depth = 2 * used, depth + 1


@step
def _find_codes(space: Space, first: int, stop: int) -> None:
    """Find the canonical codes of the symbols from `first` to `stop` by their lengths."""
    lengths, following = space.lengths, space.weights
    following[:16] = 0
    for symbol in range(first, stop):
        following[lengths[symbol]] += 1
    following[0] = code = 0
    for bits in range(1, 16):
        code, following[bits] = (code + following[bits]) << 1, code
    for symbol in range(first, stop):
        bits = lengths[symbol]
        if bits:
            space.entries[symbol] = _reversed_bits(following[bits], bits) << 5 | bits
            following[bits] += 1


@step
def _put(space: Space, place: Place, code: int, bits: int) -> Place:
    """Append at most 31 bits."""
    pending, count, word = place
    pending |= np.uint64(code) << np.uint64(count)
    count += bits
    space.words[word] = pending & np.uint64(0xFFFFFFFF)  # replaced until the word is full
    is_full = count >> 5
    return pending >> np.uint64(is_full << 5), count & 31, word + is_full


@step
def _put_list_symbol(space: Space, place: Place, symbol: int, more: int, more_bits: int) -> Place:
    """Append a symbol of the list of lengths, and the bits after it."""
    bits = _LIST_BITS[symbol]
    return _put(space, place, _LIST_CODES[symbol] | more << bits, bits + more_bits)


@step
def _write_head(space: Space, place: Place) -> Place:
    """Write the head of a block, which lists the lengths of the codes."""
    lengths = space.lengths
    literals, distances = _LITERALS, _SYMBOLS - _LITERALS
    while literals > _LENGTHS and not lengths[literals - 1]:
        literals -= 1
    while distances > 1 and not lengths[_LITERALS + distances - 1]:
        distances -= 1
    # The last block of the stream, with its own codes; sizes of the three lists of lengths
    sizes = (literals - 257) << 3 | (distances - 1) << 8 | (19 - 4) << 13
    place = _put(space, place, 0b101 | sizes, 17)
    for symbol in _LIST_ORDER:
        place = _put(space, place, _LIST_BITS[symbol], 3)
    for k in range(distances):
        lengths[literals + k] = lengths[_LITERALS + k]  # both lists are one
    k, stop = 0, literals + distances
    while k < stop:
        length, run = lengths[k], 1
        while k + run < stop and lengths[k + run] == length:
            run += 1
        k += run
        if length:
            place = _put_list_symbol(space, place, length, 0, 0)
            run -= 1
        least, most = (3, 6) if length else (11, 138)
        symbol, bits = (16, 2) if length else (18, 7)
        while run >= least:
            some = min(run, most)
            place = _put_list_symbol(space, place, symbol, some - least, bits)
            run -= some
        if run >= 3:
            place = _put_list_symbol(space, place, 17, run - 3, 3)
            run = 0
        for _ in range(run):
            place = _put_list_symbol(space, place, length, 0, 0)
    return place


@step
def _write_tokens(space: Space, place: Place, tokens: int) -> Place:
    """Write the tokens of a block, and its end."""
    entries = space.entries
    for k in range(tokens):
        token = space.tokens[k]
        if token < _IS_REPEAT:
            low, high = entries[token & 255], entries[token >> 8]
            bits = low & 31
            place = _put(space, place, low >> 5 | high >> 5 << bits, bits + (high & 31))
            continue
        length = token & _LENGTH_MASK
        symbol = _LENGTH_SYMBOL[length]
        entry, more = entries[_LENGTHS + symbol], length - _LENGTH_LEAST[symbol]
        bits = entry & 31
        place = _put(space, place, entry >> 5 | more << bits, bits + _LENGTH_MORE[symbol])
        distance = (token ^ _IS_REPEAT) >> _LENGTH_BITS
        symbol = _DISTANCE_SYMBOL[distance]
        entry, more = entries[_LITERALS + symbol], distance - _DISTANCE_LEAST[symbol]
        bits = entry & 31
        place = _put(space, place, entry >> 5 | more << bits, bits + _DISTANCE_MORE[symbol])
    return _put(space, place, entries[_END] >> 5, entries[_END] & 31)

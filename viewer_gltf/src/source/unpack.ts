/** Unpacks bytes by LZ4 and BloscLZ. A damaged stream throws a RangeError. */

const damaged = (kind: string) => new RangeError(`the ${kind} stream is broken`);

/** Unpacks a block of LZ4, by https://github.com/lz4/lz4/blob/dev/doc/lz4_Block_format.md. */
export function unpackLz4(packed: Uint8Array, bytes: number): Uint8Array {
  const out = new Uint8Array(bytes);
  let [from, to] = [0, 0];
  /** Reads a length that begins in a token; each following byte of 255 means that another byte follows. */
  const lengthOf = (first: number) => {
    let length = first;
    for (let code = first === 15 ? 255 : 0; code === 255; ) {
      if (from >= packed.length) throw damaged("lz4");
      code = packed[from++];
      length += code;
    }
    return length;
  };
  while (from < packed.length) {
    const token = packed[from++];
    const literals = lengthOf(token >> 4);
    if (from + literals > packed.length || to + literals > bytes) throw damaged("lz4");
    out.set(packed.subarray(from, from + literals), to);
    from += literals;
    to += literals;
    if (from >= packed.length) break; // the last sequence has literals alone
    const offset = packed[from] | (packed[from + 1] << 8);
    from += 2;
    const length = lengthOf(token & 15) + 4;
    copyMatch(out, to, offset, length, "lz4");
    to += length;
  }
  if (to !== bytes) throw damaged("lz4");
  return out;
}

/** Largest distance that BloscLZ encodes without two additional bytes. */
const FAR = 8191;

/** Unpacks a stream of BloscLZ in the same way as `blosclz_decompress` of c-blosc 1.21. */
export function unpackBloscLz(packed: Uint8Array, bytes: number): Uint8Array {
  const out = new Uint8Array(bytes);
  let [from, to] = [0, 0];
  const next = () => {
    if (from >= packed.length) throw damaged("blosclz");
    return packed[from++];
  };
  for (let control = next() & 31; ; control = next()) {
    if (control < 32) {
      const literals = control + 1;
      if (from + literals > packed.length || to + literals > bytes) throw damaged("blosclz");
      out.set(packed.subarray(from, from + literals), to);
      from += literals;
      to += literals;
    } else {
      let length = (control >> 5) - 1;
      for (let code = length === 6 ? 255 : 0; code === 255; length += code) code = next();
      const high = (control & 31) << 8;
      const low = next();
      const isFar = low === 255 && high === 31 << 8;
      const distance = isFar ? (next() << 8) + next() + FAR : high + low;
      copyMatch(out, to, distance + 1, length + 3, "blosclz");
      to += length + 3;
    }
    if (from >= packed.length) break;
  }
  if (to !== bytes) throw damaged("blosclz");
  return out;
}

/** Repeats bytes that were written before; the copy may overlap itself. */
function copyMatch(out: Uint8Array, to: number, back: number, length: number, kind: string): void {
  if (back < 1 || back > to || to + length > out.length) throw damaged(kind);
  if (back >= length) {
    out.copyWithin(to, to - back, to - back + length);
    return;
  }
  for (let i = to; i < to + length; i++) out[i] = out[i - back];
}

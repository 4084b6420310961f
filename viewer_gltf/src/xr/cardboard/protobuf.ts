/**
 * Reads the part of the protocol-buffer wire format that a lens profile needs: a message without
 * nested messages. Other fields are skipped, whatever their type.
 */
export type Fields = Readonly<{
  /** Floats of a field, packed or single; empty if the field is absent. */
  floats: (field: number) => readonly number[];
  whole: (field: number) => number | undefined;
  text: (field: number) => string;
}>;

/** Throws RangeError if the bytes are truncated or are not a message. */
export function readFields(bytes: Uint8Array<ArrayBuffer>): Fields {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const floats = new Map<number, number[]>();
  const wholes = new Map<number, number>();
  const texts = new Map<number, Uint8Array<ArrayBuffer>>();
  let at = 0;

  const varint = (): number => {
    let value = 0;
    for (let scale = 1; scale <= 2 ** 63; scale *= 128) {
      const byte = view.getUint8(at++);
      value += (byte & 127) * scale; // a shift would keep 32 bits only
      if (byte < 128) return value;
    }
    throw new RangeError("a varint of more than ten bytes");
  };
  const skip = (count: number): number => {
    const start = at;
    if (count > bytes.length - at) throw new RangeError("the message ends within a field");
    at += count;
    return start;
  };
  const addFloat = (field: number, offset: number) => {
    const list = floats.get(field) ?? [];
    list.push(view.getFloat32(offset, true));
    floats.set(field, list);
  };

  while (at < bytes.length) {
    const tag = varint();
    const field = Math.floor(tag / 8);
    switch (tag % 8) {
      case 0:
        wholes.set(field, varint());
        break;
      case 1:
        skip(8);
        break;
      case 2: {
        const length = varint();
        const start = skip(length);
        texts.set(field, bytes.subarray(start, start + length));
        break;
      }
      case 5:
        addFloat(field, skip(4));
        break;
      default:
        throw new RangeError(`field ${field} has no known type`);
    }
  }

  return {
    floats: (field) => {
      const packed = texts.get(field);
      // A field that does not hold floats counts as absent.
      if (packed === undefined || packed.length % 4 !== 0) return floats.get(field) ?? [];
      const packedView = new DataView(packed.buffer, packed.byteOffset, packed.byteLength);
      return Array.from({ length: packed.length / 4 }, (_, i) =>
        packedView.getFloat32(4 * i, true),
      );
    },
    whole: (field) => wholes.get(field),
    text: (field) => new TextDecoder().decode(texts.get(field)),
  };
}

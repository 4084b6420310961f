/**
 * The decoders that a glTF file needs (meshopt, Basis Universal), read from its JSON before the
 * whole file is parsed.
 */

/**
 * glTF 2.0, section 4.4: a glb has a header of 12 bytes, then chunks; the first one is the JSON.
 */
const MAGIC = 0x46546c67;
const JSON_LENGTH_AT = 12;
const JSON_AT = 20;

export type Needs = Readonly<{ meshopt: boolean; basis: boolean }>;

type Extended = Readonly<{ extensions?: Readonly<Record<string, unknown>> }>;
type Document = Readonly<{ bufferViews?: readonly Extended[]; textures?: readonly Extended[] }>;

/** Throws SyntaxError or RangeError if the JSON is damaged or truncated. */
export function needsOf(data: ArrayBuffer | string): Needs {
  const document = JSON.parse(jsonOf(data)) as Document;
  const has = (list: readonly Extended[] | undefined, name: string) =>
    list?.some(({ extensions }) => extensions?.[name] !== undefined) === true;
  return {
    meshopt:
      has(document.bufferViews, "EXT_meshopt_compression") ||
      has(document.bufferViews, "KHR_meshopt_compression"),
    basis: has(document.textures, "KHR_texture_basisu"),
  };
}

function jsonOf(data: ArrayBuffer | string): string {
  if (typeof data === "string") return data;
  const view = new DataView(data);
  if (data.byteLength < JSON_AT || view.getUint32(0, true) !== MAGIC) {
    return new TextDecoder().decode(data);
  }
  return new TextDecoder().decode(
    new Uint8Array(data, JSON_AT, view.getUint32(JSON_LENGTH_AT, true)),
  );
}

/** A channel's baked transfer functions, and the table that a choice among them makes. */
import { BundleError } from "../bundle/errors";
import { fetchFile } from "../bundle/fetch";
import type { Channel } from "../bundle/generated/bundle";
import { readLevel, readTexture } from "../bundle/ktx2";

export const ENTRIES = 256;

/** RGBA, one entry for each intensity; RGB is a factor to the channel's colour. */
export type TransferFunction = Uint8Array<ArrayBuffer>;

/** The channel's transfer functions by name. Throws BundleError. */
export async function loadTransferFunctions(
  base: string,
  channel: Channel,
): Promise<ReadonlyMap<string, TransferFunction>> {
  const { path } = channel.lut;
  const names = channel.transfer_functions;
  const size = [ENTRIES, names.length, 1] as const;
  const texture = readTexture(await fetchFile(base, channel.lut), path, "R8G8B8A8", size);
  const texels = await readLevel(texture, path, "R8G8B8A8", 0);
  if (!names.includes(channel.transfer_function)) {
    throw new BundleError(
      `manifest.json: transfer_function of ${channel.id}: expected one of ${names.join(", ")}, ` +
        `found ${channel.transfer_function}`,
    );
  }
  return new Map(
    names.map((name, row) => [name, texels.slice(row * ENTRIES * 4, (row + 1) * ENTRIES * 4)]),
  );
}

/**
 * The function stretched over a window of the intensities, its opacity times a factor. Pure.
 *
 * @param window low and high end, 0..1 of the intensities
 */
export function lookUpTable(
  entries: TransferFunction,
  window: readonly [number, number],
  opacity: number,
): Uint8Array<ArrayBuffer> {
  const [low, high] = window;
  const table = new Uint8Array(ENTRIES * 4);
  for (let i = 0; i < ENTRIES; i++) {
    const part = (i / (ENTRIES - 1) - low) / (high - low);
    const at = Math.min(1, Math.max(0, part)) * (ENTRIES - 1);
    const left = Math.min(ENTRIES - 2, Math.floor(at));
    for (let k = 0; k < 4; k++) {
      const [a, b] = [entries[4 * left + k], entries[4 * left + 4 + k]];
      const value = a + (b - a) * (at - left);
      table[4 * i + k] = Math.round(k === 3 ? value * opacity : value);
    }
  }
  return table;
}

/** The opacities of a table, 0..255. */
export function opacities(table: Uint8Array): Uint8Array<ArrayBuffer> {
  return Uint8Array.from({ length: ENTRIES }, (_, i) => table[4 * i + 3]);
}

/** Rise of opacity, as a share of all intensities, of an edge that is shaded as it is. */
const GENTLE_RISE = 0.12;
const MOST_CONTRAST = 3;

/**
 * Factor to the gradients that a table's edges are shaded by. An edge that crosses the whole rise of the
 * opacity is a boundary, however few of all intensities it crosses: the skin of a CT is one.
 */
export function edgeContrast(table: Uint8Array): number {
  const alphas = opacities(table);
  const most = Math.max(...alphas);
  const first = alphas.findIndex((alpha) => alpha > 0);
  if (most === 0 || alphas[0] > 0) return 1;
  const half = alphas.findIndex((alpha) => 2 * alpha >= most);
  const rise = (half - first + 1) / (ENTRIES - 1);
  return Math.min(MOST_CONTRAST, Math.max(1, GENTLE_RISE / rise));
}

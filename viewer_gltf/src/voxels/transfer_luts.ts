/** A channel's transfer functions, and the lookup table made from one of them. */
import { BundleError } from "../bundle/errors";
import { fetchFile } from "../bundle/fetch";
import type { Channel } from "../bundle/generated/bundle";
import { readLevel, readTexture } from "../bundle/ktx2";

export const ENTRIES = 256;

/** RGBA, one entry for each intensity; RGB is a factor of the channel's colour. */
export type TransferFunction = Uint8Array<ArrayBuffer>;

/** Loads the channel's transfer functions, by name. Throws BundleError. */
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
      `manifest.json: transfer_function of ${channel.id} is ${channel.transfer_function}; ` +
        `expected one of ${names.join(", ")}`,
    );
  }
  return new Map(
    names.map((name, row) => [name, texels.slice(row * ENTRIES * 4, (row + 1) * ENTRIES * 4)]),
  );
}

/**
 * Stretches the function over a window of the intensities, and multiplies its opacity by a factor.
 *
 * @param window low and high end, as shares of the intensities
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

export function opacities(table: Uint8Array): Uint8Array<ArrayBuffer> {
  return Uint8Array.from({ length: ENTRIES }, (_, i) => table[4 * i + 3]);
}

/**
 * Rise of the opacity, as a share of all intensities, of an edge that is shaded without added
 * contrast.
 */
const GENTLE_RISE = 0.12;
const MOST_CONTRAST = 3;

/**
 * Factor of the gradients that shade a table's edges. An edge that crosses the whole rise of the
 * opacity is a boundary, even if it crosses few of all intensities, like the skin in a CT.
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

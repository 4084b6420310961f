/** A channel's baked transfer functions, and what of a brick they make visible. */
import { BundleError } from "../bundle/errors";
import { fetchFile } from "../bundle/fetch";
import type { Channel } from "../bundle/generated/bundle";
import { readLevel, readTexture } from "./ktx2";
import { opacityRanges } from "./occupancy";

const ENTRIES = 256;

export type TransferFunction = Readonly<{
  /** RGBA, one entry for each intensity; RGB is a factor to the channel's colour. */
  entries: Uint8Array<ArrayBuffer>;
  /** See `opacityRanges`. */
  ranges: Uint8Array;
}>;

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
    names.map((name, row) => {
      const entries = texels.slice(row * ENTRIES * 4, (row + 1) * ENTRIES * 4);
      const alpha = Uint8Array.from({ length: ENTRIES }, (_, i) => entries[4 * i + 3]);
      return [name, { entries, ranges: opacityRanges(alpha) }];
    }),
  );
}

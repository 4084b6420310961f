/**
 * Decompresses textures without blocking the page: in one worker, which starts with the first volume.
 * A texture holds one byte for each channel: R8, RG8, or RGBA8 for three and four channels.
 */
import { BundleError } from "./errors";

export type DecodeRequest = Readonly<{
  id: number;
  /** A zstd frame for each channel. */
  parts: readonly Uint8Array[];
  /** Size of each part after decompression, bytes. */
  bytes: number;
  /** Number of texels along each axis; absent: no ranges of cells are computed. */
  size?: readonly [number, number, number];
}>;

export type DecodeAnswer = Readonly<{
  id: number;
  texels?: Uint8Array<ArrayBuffer>;
  /** `cellRanges` of each part, if the request has a size. */
  cells?: readonly Uint8Array<ArrayBuffer>[];
  fault?: string;
  /** Index of the part that could not be decompressed. */
  part?: number;
}>;

/** A zstd frame, and its name in messages. */
export type Frame = Readonly<{ bytes: Uint8Array; name: string }>;

export class DecodeError extends BundleError {
  constructor(
    readonly part: number,
    text: string,
  ) {
    super(text);
  }
}

type Waiting = Readonly<{ resolve: (answer: DecodeAnswer) => void }>;

let worker: Worker | null = null;
let last = 0;
const waiting = new Map<number, Waiting>();

function start(): Worker {
  const started = new Worker(new URL("./decode_worker.ts", import.meta.url), { type: "module" });
  started.addEventListener("message", ({ data }: MessageEvent<DecodeAnswer>) => {
    waiting.get(data.id)?.resolve(data);
    waiting.delete(data.id);
  });
  started.addEventListener("error", (event) => {
    for (const [id, { resolve }] of waiting) {
      resolve({ id, fault: event.message || "the worker can't be started" });
    }
    waiting.clear();
    worker = null; // the next request tries to start another worker
  });
  return started;
}

/** Returns the texels of all frames, interleaved. Throws DecodeError, which names the frame at fault. */
export async function decodeTexels(
  frames: readonly Frame[],
  bytes: number,
): Promise<Uint8Array<ArrayBuffer>> {
  return (await decode(frames, { bytes })).texels;
}

/**
 * Returns the texels of all frames, interleaved, and the `cellRanges` of each. Throws DecodeError.
 *
 * @param size number of texels along each axis
 */
export function decodeVolume(
  frames: readonly Frame[],
  size: readonly [number, number, number],
): Promise<Required<Pick<DecodeAnswer, "texels" | "cells">>> {
  return decode(frames, { bytes: size[0] * size[1] * size[2], size });
}

async function decode(
  frames: readonly Frame[],
  asked: Pick<DecodeRequest, "bytes" | "size">,
): Promise<Required<Pick<DecodeAnswer, "texels" | "cells">>> {
  const port = worker ?? start();
  worker = port;
  const request = { id: ++last, parts: frames.map((each) => each.bytes), ...asked };
  const {
    texels,
    cells = [],
    fault,
    part,
  } = await new Promise<DecodeAnswer>((resolve) => {
    waiting.set(request.id, { resolve });
    port.postMessage(request satisfies DecodeRequest);
  });
  if (texels !== undefined) return { texels, cells };
  throw new DecodeError(part ?? 0, `${frames[part ?? 0].name}: ${fault}`);
}

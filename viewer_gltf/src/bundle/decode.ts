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
}>;

export type DecodeAnswer = Readonly<{
  id: number;
  texels?: Uint8Array<ArrayBuffer>;
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
  const port = worker ?? start();
  worker = port;
  const request: DecodeRequest = { id: ++last, parts: frames.map((each) => each.bytes), bytes };
  const { texels, fault, part } = await new Promise<DecodeAnswer>((resolve) => {
    waiting.set(request.id, { resolve });
    port.postMessage(request);
  });
  if (texels !== undefined) return texels;
  throw new DecodeError(part ?? 0, `${frames[part ?? 0].name}: ${fault}`);
}

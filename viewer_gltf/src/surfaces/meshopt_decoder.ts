/**
 * meshopt's decoder in a worker. meshopt's own workers are made from a Blob, which the page's
 * content policy forbids; this one is a file.
 */
export type MeshoptRequest = Readonly<{
  id: number;
  count: number;
  stride: number;
  source: Uint8Array;
  mode: string;
  filter: string | undefined;
}>;

export type MeshoptAnswer = Readonly<{
  id: number;
  decoded?: Uint8Array<ArrayBuffer>;
  fault?: string;
}>;

type Waiting = Readonly<{
  resolve: (decoded: Uint8Array<ArrayBuffer>) => void;
  reject: (error: Error) => void;
}>;

/** The part of the decoder that three.js's loader uses. */
export class MeshoptWorker {
  readonly supported = true;
  readonly ready = Promise.resolve();
  private readonly worker: Worker;
  private readonly waiting = new Map<number, Waiting>();
  private last = 0;
  /** The reason why no answers come any more: the worker's script did not load. */
  private fault: Error | null = null;

  constructor() {
    this.worker = new Worker(new URL("./meshopt_worker.ts", import.meta.url), { type: "module" });
    this.worker.addEventListener("message", ({ data }: MessageEvent<MeshoptAnswer>) => {
      const job = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      if (data.decoded !== undefined) job?.resolve(data.decoded);
      else job?.reject(new Error(`meshopt: ${data.fault}`));
    });
    this.worker.addEventListener("error", (event) => {
      this.fault = new Error(`meshopt: ${event.message || "the worker can't be started"}`);
      for (const { reject } of this.waiting.values()) reject(this.fault);
      this.waiting.clear();
    });
  }

  decodeGltfBufferAsync(
    count: number,
    stride: number,
    source: Uint8Array,
    mode: string,
    filter?: string,
  ): Promise<Uint8Array<ArrayBuffer>> {
    if (this.fault !== null) return Promise.reject(this.fault);
    const id = ++this.last;
    // a copy of this part, because posting the view would send the whole file
    const request: MeshoptRequest = { id, count, stride, source: source.slice(), mode, filter };
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.worker.postMessage(request, [request.source.buffer]);
    });
  }

  dispose(): void {
    this.worker.terminate();
    for (const { reject } of this.waiting.values())
      reject(new Error("meshopt: the decoder was disposed"));
    this.waiting.clear();
  }
}

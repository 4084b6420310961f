/**
 * Requests empty-space tables from a worker. Dragging a transfer function makes more requests than
 * answers are needed. So the worker gets one request at a time, and of the waiting ones only the
 * latest for each key (a tile) is kept.
 */
import type { OccupancyRequest } from "../voxels/empty_space";

/** The part of a Worker that the client uses, so that tests need no worker. */
export type OccupancyPort = Pick<
  Worker,
  "postMessage" | "terminate" | "onmessage" | "onerror" | "onmessageerror"
>;

type Job = Readonly<{
  key: string;
  request: OccupancyRequest;
  resolve: (distances: Uint8Array<ArrayBuffer> | null) => void;
  reject: (error: Error) => void;
}>;

function startOccupancyWorker(): Worker {
  return new Worker(new URL("./empty_space_worker.ts", import.meta.url), { type: "module" });
}

export class OccupancyClient {
  private readonly port: OccupancyPort;
  private readonly waiting = new Map<string, Job>();
  private running: Job | null = null;
  private isDisposed = false;
  /** The reason why no worker answers any more; null while it runs. */
  private fault: Error | null = null;

  constructor(start: () => OccupancyPort = startOccupancyWorker) {
    this.port = start();
    this.port.onmessage = ({ data }: MessageEvent<Uint8Array<ArrayBuffer>>) => {
      const job = this.running;
      if (job !== null) job.resolve(this.waiting.has(job.key) ? null : data);
      this.next();
    };
    this.port.onerror = (event) => {
      // The promise reports the fault, so it need not be printed on the console too.
      event.preventDefault();
      if (event.message) this.fail(event.message);
      else this.stop("the worker's script did not load");
    };
    this.port.onmessageerror = () => this.fail("its answer can't be read");
  }

  /**
   * Returns the distances of `brickDistances`, or null if a newer request with the same key has
   * replaced this one or the client was disposed. The request's arrays are copied. Rejects if the
   * arrays do not fit each other or the worker can't run.
   */
  computeDistances(
    key: string,
    request: OccupancyRequest,
  ): Promise<Uint8Array<ArrayBuffer> | null> {
    if (this.isDisposed) return Promise.resolve(null);
    if (this.fault !== null) return Promise.reject(this.fault);
    return new Promise((resolve, reject) => {
      this.waiting.get(key)?.resolve(null);
      this.waiting.delete(key); // the newest goes to the end, so that no key starves another
      this.waiting.set(key, { key, request, resolve, reject });
      if (this.running === null) this.next();
    });
  }

  private next(): void {
    this.running = null;
    const [job] = this.waiting.values();
    if (job === undefined) return;
    this.waiting.delete(job.key);
    this.running = job;
    this.port.postMessage(job.request);
  }

  private fail(reason: string): void {
    this.running?.reject(new Error(`the empty-space table could not be computed: ${reason}`));
    this.next();
  }

  private stop(reason: string): void {
    this.fault = new Error(`no empty-space table can be computed: ${reason}`);
    this.running?.reject(this.fault);
    for (const job of this.waiting.values()) job.reject(this.fault);
    this.waiting.clear();
    this.running = null;
  }

  dispose(): void {
    this.isDisposed = true;
    this.port.terminate();
    this.running?.resolve(null);
    for (const job of this.waiting.values()) job.resolve(null);
    this.waiting.clear();
    this.running = null;
  }
}

/**
 * Requests shading from a worker. While a function is dragged or the view turns, there are more
 * requests than the worker can answer. So it gets one request at a time, and the newest replaces
 * the one that waits.
 */
import type { Grid } from "./coarse_matter";
import type { Matter, ShadingRequest } from "./shading_maker";

/** The part of a Worker that the client uses, so that tests need no worker. */
export type ShadingPort = Pick<
  Worker,
  "postMessage" | "terminate" | "onmessage" | "onerror" | "onmessageerror"
>;

export type Shading = Readonly<{ grid: Grid; texels: Uint8Array<ArrayBuffer> }>;

function startShadingWorker(): ShadingPort {
  return new Worker(new URL("./shading_worker.ts", import.meta.url), { type: "module" });
}

export class ShadingClient {
  private port: ShadingPort | null = null;
  private running: Grid | null = null;
  private waiting: ShadingRequest | null = null;
  /** Grid of the last matter that was sent. */
  private grid: Grid | null = null;
  private hasFailed = false;

  /** @param onFault called once; after that there is no new shading */
  constructor(
    private readonly onShading: (shading: Shading) => void,
    private readonly onFault: (error: Error) => void,
    private readonly start: () => ShadingPort = startShadingWorker,
  ) {}

  get isBusy(): boolean {
    return this.running !== null;
  }

  ask(request: ShadingRequest): void {
    if (this.hasFailed) return;
    const matter: Matter | null = request.matter ?? this.waiting?.matter ?? null;
    this.waiting = { ...request, matter };
    if (this.running === null) this.next();
  }

  private next(): void {
    const request = this.waiting;
    this.waiting = this.running = null;
    if (request === null) return;
    this.port ??= this.open();
    this.grid = request.matter?.grid ?? this.grid;
    this.running = this.grid;
    this.port.postMessage(request);
  }

  private open(): ShadingPort {
    const port = this.start();
    port.onmessage = ({ data }: MessageEvent<Uint8Array<ArrayBuffer>>) => {
      const grid = this.running;
      this.next();
      if (grid !== null) this.onShading({ grid, texels: data });
    };
    port.onerror = (event) => {
      event.preventDefault(); // reported, so it need not be printed on the console too
      this.fail(event.message || "the worker's script did not load");
    };
    port.onmessageerror = () => this.fail("its answer can't be read");
    return port;
  }

  private fail(reason: string): void {
    this.hasFailed = true;
    this.running = this.waiting = null;
    this.onFault(new Error(`volumes are drawn without shading: ${reason}`));
  }

  dispose(): void {
    this.hasFailed = true;
    this.port?.terminate();
    this.running = this.waiting = null;
  }
}

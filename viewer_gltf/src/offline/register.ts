/** Make the viewer and what it has shown usable without a network, where the browser can. */
import { type Asked, allAsked } from "../bundle/request_log";
import { ownBundle } from "./request_plan";
import type { IsKept, Opened } from "./sw";
import workerAddress from "./sw?worker&url";

/** Longest time until a worker takes its pages over, ms. */
const CLAIM_MS = 10_000;

/** Only on a host that browsers trust (https, or this machine), and for bundles of that host. */
function canKeep(page: string, isSecure: boolean): boolean {
  return /^https?:/.test(page) && isSecure && ownBundle(page) !== null;
}

/** The way to the service worker that keeps what was shown. */
export class Keeping {
  private constructor(
    private readonly worker: ServiceWorker,
    /** Whether the page was opened through the worker, as on a later visit. */
    readonly wasServed: boolean,
  ) {}

  /** Start the service worker; null: this browser keeps nothing for this page. */
  static async start(): Promise<Keeping | null> {
    const isAble = !import.meta.env.DEV && canKeep(location.href, isSecureContext);
    // a frame without an origin may not even ask for it
    const { serviceWorker } = (isAble ? navigator : {}) as {
      serviceWorker?: ServiceWorkerContainer;
    };
    if (serviceWorker === undefined) return null;
    const wasServed = serviceWorker.controller !== null;
    try {
      await serviceWorker.register(workerAddress);
    } catch {
      return null; // such as where cookies are blocked
    }
    const { active } = await serviceWorker.ready;
    await served(serviceWorker);
    return active && new Keeping(active, wasServed);
  }

  /**
   * Hand over what was loaded before the worker took the page over, or has been missed since.
   *
   * @param also addresses of files of the bundle that the page has not asked for
   * @returns whether the page would open without a network
   */
  adopt(missed: readonly Asked[] | null, also: readonly string[]): Promise<boolean> {
    const asked = missed ?? (this.wasServed ? [] : allAsked());
    const loaded = performance.getEntriesByType("resource").map(({ name }) => name);
    return this.ask<boolean>({
      type: "opened",
      page: location.href,
      asked: [...asked, ...also.map((url) => ({ url, range: null }))],
      loaded,
    });
  }

  /** For each request whether its answer is kept, or is not the bundle's to keep. */
  isKept(asked: readonly Asked[]): Promise<readonly boolean[]> {
    return this.ask<readonly boolean[]>({ type: "is-kept", page: location.href, asked });
  }

  private ask<T>(message: Opened | IsKept): Promise<T> {
    const { port1, port2 } = new MessageChannel();
    return new Promise((resolve) => {
      port1.onmessage = ({ data }: MessageEvent<T>) => {
        port1.close();
        resolve(data);
      };
      this.worker.postMessage(message, [port2]);
    });
  }
}

/** Resolves once the page's requests pass the worker, or it is clear that they won't. */
function served(serviceWorker: ServiceWorkerContainer): Promise<void> {
  if (serviceWorker.controller !== null) return Promise.resolve();
  return new Promise((resolve) => {
    serviceWorker.addEventListener("controllerchange", () => resolve(), { once: true });
    setTimeout(resolve, CLAIM_MS); // a page that was reloaded past its worker is never served
  });
}

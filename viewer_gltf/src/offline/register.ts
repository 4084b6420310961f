/** Makes the viewer and everything it has shown usable without a network, if the browser supports that. */
import { type Asked, allAsked } from "../bundle/request_log";
import { ownBundle } from "./request_plan";
import type { IsKept, Opened } from "./sw";
import workerAddress from "./sw?worker&url";

/** Longest wait until a worker takes over its pages, ms. */
const CLAIM_MS = 10_000;

/** Returns whether files can be kept: only on a secure host (https, or this machine), and for bundles of that host. */
function canKeep(page: string, isSecure: boolean): boolean {
  return /^https?:/.test(page) && isSecure && ownBundle(page) !== null;
}

/** Sends messages to the service worker, which keeps everything that was shown. */
export class Keeping {
  private constructor(
    private readonly worker: ServiceWorker,
    /** Whether the worker served the page when it opened, as on a later visit. */
    readonly wasServed: boolean,
  ) {}

  /** Starts the service worker; null if this browser can't keep files for this page. */
  static async start(): Promise<Keeping | null> {
    const isAble = !import.meta.env.DEV && canKeep(location.href, isSecureContext);
    // In a frame without an origin, reading `serviceWorker` throws; it is read only if files can be kept.
    const { serviceWorker } = (isAble ? navigator : {}) as {
      serviceWorker?: ServiceWorkerContainer;
    };
    if (serviceWorker === undefined) return null;
    const wasServed = serviceWorker.controller !== null;
    try {
      await serviceWorker.register(workerAddress);
    } catch {
      return null; // for example because cookies are blocked
    }
    const { active } = await serviceWorker.ready;
    await served(serviceWorker);
    return active && new Keeping(active, wasServed);
  }

  /**
   * Asks the worker to keep files that were loaded before it took over the page, or that it has missed since.
   *
   * @param also addresses of files of the bundle that the page has not requested
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

  /** Returns for each request whether its answer is kept; true also if it is not for a file of the bundle. */
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

/** Resolves once the worker receives the page's requests, or has not done so within CLAIM_MS. */
function served(serviceWorker: ServiceWorkerContainer): Promise<void> {
  if (serviceWorker.controller !== null) return Promise.resolve();
  return new Promise((resolve) => {
    serviceWorker.addEventListener("controllerchange", () => resolve(), { once: true });
    setTimeout(resolve, CLAIM_MS); // a forced reload bypasses the worker, which then never serves the page
  });
}

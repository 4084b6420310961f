/** Make the viewer and what it has shown usable without a network, where the browser can. */
import { takeAsked } from "../bundle/request_log";
import { ownBundle } from "./request_plan";
import type { Opened } from "./sw";
import workerAddress from "./sw?worker&url";

/** Longest time until a worker takes its pages over, ms. */
const CLAIM_MS = 10_000;

/** Only on a host that browsers trust (https, or this machine), and for bundles of that host. */
export function canKeep(page: string, isSecure: boolean): boolean {
  return /^https?:/.test(page) && isSecure && ownBundle(page) !== null;
}

/**
 * Start the service worker and hand it what was loaded before; for after the first picture. Sets
 * `data-offline="ready"` on the page's root once all that was shown is kept, or "refused" where the
 * browser keeps nothing, as on a full disk: the viewer then works as before.
 *
 * @param onReady called once on the visit that made it so
 * @param also addresses of files of the bundle that the page has not asked for
 */
export async function keepOffline(onReady: () => void, also: readonly string[]): Promise<void> {
  const isAble = !import.meta.env.DEV && canKeep(location.href, isSecureContext);
  // a frame without an origin may not even ask for it
  const { serviceWorker } = (isAble ? navigator : {}) as { serviceWorker?: ServiceWorkerContainer };
  if (serviceWorker === undefined) {
    takeAsked(); // nobody will want the log
    return;
  }
  const wasServed = serviceWorker.controller !== null;
  try {
    await serviceWorker.register(workerAddress);
  } catch {
    takeAsked();
    return; // such as where cookies are blocked
  }
  const { active } = await serviceWorker.ready;
  await served(serviceWorker);
  const { port1, port2 } = new MessageChannel();
  port1.onmessage = ({ data }: MessageEvent<boolean>) => {
    document.documentElement.dataset.offline = data ? "ready" : "refused";
    if (data && !wasServed) onReady();
    port1.close();
  };
  // Requests from now on pass the worker; the page reports the earlier ones to it.
  const asked = takeAsked();
  const loaded = performance.getEntriesByType("resource").map(({ name }) => name);
  const message: Opened = {
    type: "opened",
    page: location.href,
    asked: [...(wasServed ? [] : asked), ...also.map((url) => ({ url, range: null }))],
    loaded,
  };
  active?.postMessage(message, [port2]);
}

/** Resolves once the page's requests pass the worker, or it is clear that they won't. */
function served(serviceWorker: ServiceWorkerContainer): Promise<void> {
  if (serviceWorker.controller !== null) return Promise.resolve();
  return new Promise((resolve) => {
    serviceWorker.addEventListener("controllerchange", () => resolve(), { once: true });
    setTimeout(resolve, CLAIM_MS); // a page that was reloaded past its worker is never served
  });
}

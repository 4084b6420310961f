/**
 * The service worker: hands the page's requests to the keeper. It serves the viewer's folder, and
 * is built as sw.js beside index.html, with the list of the viewer's files filled in.
 */
import type { Asked } from "../bundle/request_log";
import { Keeper } from "./keeper";
import { Keys } from "./request_plan";
import { Store } from "./store";

/**
 * A page's report of its first picture. The answer, on the port, comes once all is
 * kept: whether the page would open without a network.
 */
export type Opened = Readonly<{
  type: "opened";
  page: string;
  /** Of the bundle, before this worker answered. */
  asked: readonly Asked[];
  /** Addresses of all that the page has loaded, the viewer's own parts among them. */
  loaded: readonly string[];
}>;

/** A page's question for each request whether its answer needs no network; the answers come on the port. */
export type IsKept = Readonly<{ type: "is-kept"; page: string; asked: readonly Asked[] }>;

// TypeScript's types of pages and of service workers exclude each other; this is what is used here.
type Extendable = Event & { waitUntil(work: Promise<unknown>): void };
type FetchRequest = Extendable & {
  request: Request;
  clientId: string;
  respondWith(response: Promise<Response>): void;
};
type Message = Extendable & { data: Opened | IsKept; ports: readonly MessagePort[] };
type ServiceWorkerScope = {
  registration: { scope: string };
  skipWaiting(): Promise<void>;
  clients: {
    claim(): Promise<void>;
    get(id: string): Promise<{ url: string } | undefined>;
  };
  addEventListener(type: "install" | "activate", listener: (event: Extendable) => void): void;
  addEventListener(type: "fetch", listener: (event: FetchRequest) => void): void;
  addEventListener(type: "message", listener: (event: Message) => void): void;
};
const worker = self as unknown as ServiceWorkerScope;

/** Relative to the viewer's folder; filled in by the build. */
const FILES: readonly string[] = JSON.parse("__VIEWER_FILES__");
/** Large, and of use to few bundles: kept once it was needed. */
const isOptional = (name: string) => name.includes("basis");
const isHashed = (name: string) => name.startsWith("assets/");

const folder = worker.registration.scope;
const keys = new Keys(folder);

/** Null where the browser keeps nothing, as when storage is forbidden. */
const opened: Promise<Keeper | null> = Store.open(`stereocell ${folder}`, keys.ledger).then(
  (store) =>
    new Keeper(
      store,
      keys,
      folder,
      FILES.filter((name) => !isHashed(name)),
    ),
  () => null,
);

worker.addEventListener("install", (event) => {
  const install = async () => {
    const keeper = await opened;
    await keeper?.keepViewer(FILES.filter((name) => !isOptional(name)));
    await worker.skipWaiting();
  };
  event.waitUntil(install());
});

worker.addEventListener("activate", (event) => {
  const activate = async () => {
    const keeper = await opened;
    await keeper?.dropOldViewer(FILES);
    await worker.clients.claim();
    await keeper?.save();
  };
  event.waitUntil(activate());
});

worker.addEventListener("fetch", (event) => {
  const { request, clientId } = event;
  if (request.method !== "GET" || new URL(request.url).origin !== new URL(folder).origin) return;
  const works: Promise<unknown>[] = [];
  const answer = async () => {
    const keeper = await opened;
    const isOpening = request.mode === "navigate";
    const page = isOpening ? null : ((await worker.clients.get(clientId))?.url ?? folder);
    if (keeper === null) return fetch(request);
    const later = (work: Promise<unknown>) => works.push(work.catch(() => undefined));
    return keeper.answer(keeper.plan(request.url, page), request, later);
  };
  const answered = answer();
  event.respondWith(answered);
  const finish = async () => {
    await answered.catch(() => undefined);
    while (works.length > 0) await Promise.allSettled(works.splice(0)); // works may add works
    await (await opened)?.save();
  };
  event.waitUntil(finish());
});

async function adopt({ page, asked, loaded }: Opened): Promise<boolean> {
  const keeper = await opened;
  // a part that decodes textures has others, which its own worker has loaded unseen
  if (loaded.some(isOptional)) await keeper?.keepViewer(FILES.filter(isOptional));
  await keeper?.adopt(page, asked).catch(() => undefined); // the network went; the next visit does
  await keeper?.save();
  return keeper?.hasPage === true;
}

worker.addEventListener("message", (event) => {
  const { data } = event;
  const answer = async () => {
    if (data.type === "opened") return adopt(data);
    return (await opened)?.areKept(data.page, data.asked) ?? data.asked.map(() => false);
  };
  event.waitUntil(answer().then((words) => event.ports[0]?.postMessage(words)));
});

/**
 * The service worker, which passes the page's requests to the keeper. It serves the viewer's folder. The build writes it
 * as sw.js beside index.html, and inserts the list of the viewer's files.
 */
import type { Asked } from "../bundle/request_log";
import { Keeper } from "./keeper";
import { Keys } from "./request_plan";
import { Store } from "./store";

/**
 * A page's message that it has drawn its first frame. Once all files are kept, the worker answers on the port whether
 * the page would open without a network.
 */
export type Opened = Readonly<{
  type: "opened";
  page: string;
  /** Requests for the bundle's files before this worker answered them. */
  asked: readonly Asked[];
  /** Addresses of everything that the page has loaded, including the viewer's own parts. */
  loaded: readonly string[];
}>;

/** A page's question whether the answer to each request needs no network. The worker answers on the port. */
export type IsKept = Readonly<{ type: "is-kept"; page: string; asked: readonly Asked[] }>;

// TypeScript's types of pages and of service workers exclude each other. These are the types that are used here.
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

/** The viewer's files, relative to its folder; the build inserts them. */
const FILES: readonly string[] = JSON.parse("__VIEWER_FILES__");
/** Whether a file is large and needed by few bundles; such files are kept only after a page has loaded one. */
const isOptional = (name: string) => name.includes("basis");
const isHashed = (name: string) => name.startsWith("assets/");

const folder = worker.registration.scope;
const keys = new Keys(folder);

/** The keeper; null if the browser keeps no files, for example because storage is forbidden. */
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
    while (works.length > 0) await Promise.allSettled(works.splice(0)); // work may add more work
    await (await opened)?.save();
  };
  event.waitUntil(finish());
});

async function adopt({ page, asked, loaded }: Opened): Promise<boolean> {
  const keeper = await opened;
  // The part that decodes textures loads more files in its own worker, and the page does not list those.
  if (loaded.some(isOptional)) await keeper?.keepViewer(FILES.filter(isOptional));
  await keeper?.adopt(page, asked).catch(() => undefined); // the network failed; the next visit tries again
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

/**
 * Answers requests from the network and the store, so that everything that was shown once also shows without a
 * network. Files of a bundle are kept under the SHA-256 in its files.json, and parts of files also under their range.
 * A file that changes on the host thus becomes a new entry, and an old one is never shown in its place.
 */
import { checkFile, fileAddress } from "../bundle/fetch";
import type { FileRef } from "../bundle/generated/bundle";
import type { Asked } from "../bundle/request_log";
import { isKept, type Keys, ownBundle, type Plan, planFor } from "./request_plan";
import type { Store } from "./store";

/** Longest wait for the network's answer, ms; after that a kept copy is used. */
const PATIENCE_MS = 5000;
const FIRST_SERVER_FAULT = 500;

type Listed = Readonly<Record<string, Omit<FileRef, "path">>>;
/** Registers work that continues after the answer was sent. */
export type Later = (work: Promise<unknown>) => void;

export class Keeper {
  /** The files of each bundle by the manifest that was read last; null if unknown. */
  private readonly listed = new Map<string, Promise<Listed | null>>();
  /** Requests that were answered while a bundle's files were unknown, as just after this worker took over the page. */
  private readonly unlisted = new Map<string, Asked>();

  constructor(
    private readonly store: Store,
    private readonly keys: Keys,
    private readonly folder: string,
    private readonly fixed: readonly string[],
  ) {}

  plan(address: string, page: string | null): Plan {
    return planFor(address, this.folder, page, this.fixed);
  }

  answer(plan: Plan, request: Request, later: Later): Promise<Response> {
    switch (plan.kind) {
      case "page":
        return this.networkFirst(this.keys.page, request, later);
      case "fixed":
        return this.networkFirst(this.keys.asset(plan.name), request, later);
      case "asset":
        return this.asset(this.keys.asset(plan.name), request, later);
      case "manifest":
        return this.manifest(plan.base, request, later);
      case "file":
        return this.file(plan.base, plan.path, request, later);
      case "none":
        return fetch(request);
    }
  }

  /** Keeps the viewer's own files, and drops those of an older version. */
  async keepViewer(names: readonly string[]): Promise<void> {
    const keepOne = async (name: string) => {
      const key = this.keys.asset(name);
      if (this.store.has(key) && !this.fixed.includes(name)) return;
      await this.keep(key, await fetch(this.folder + name));
    };
    await Promise.allSettled(names.map(keepOne));
  }

  async dropOldViewer(names: readonly string[]): Promise<void> {
    const wanted = new Set(names.map((name) => this.keys.asset(name)));
    await this.store.retain(this.keys.asset(""), (key) => wanted.has(key));
  }

  /** Keeps the files that a page has loaded before this worker began to serve it. */
  async adopt(page: string, asked: readonly Asked[]): Promise<void> {
    const works: Promise<unknown>[] = [];
    const later: Later = (work) => works.push(work.catch(() => undefined));
    const seen = { cache: "force-cache" } as const; // the file may still be in the browser's own cache
    const bare = page.split(/[?#]/)[0];
    if (!this.store.has(this.keys.page)) {
      later(fetch(bare, seen).then((response) => this.keep(this.keys.page, response)));
    }
    const base = ownBundle(page);
    if (base !== null && (await this.listedOf(base)) === null) {
      // The promise is stored at once: later requests of the page wait for the list, and their files are kept.
      const request = new Request(fileAddress(base, "manifest.json"), { cache: "no-cache" });
      const listed = this.networkFirst(this.keys.manifest(base), request, later)
        .then(async (response) =>
          response.ok ? this.readListed(base, await response.text()) : null,
        )
        .catch(() => null);
      this.listed.set(base, listed);
      await listed;
    }
    const missed = [...this.unlisted.values()];
    this.unlisted.clear();
    for (const { url, range } of [...asked, ...missed]) {
      const plan = this.plan(url, page);
      if (plan.kind !== "file") continue;
      const headers: HeadersInit = range === null ? {} : { Range: range };
      // The files are fetched one after another, because the page may still be loading.
      const answer = this.answer(plan, new Request(url, { ...seen, headers }), later);
      await answer.then((response) => response.body?.cancel()).catch(() => undefined);
    }
    await Promise.all(works);
  }

  /** Whether the page would open without a network. */
  get hasPage(): boolean {
    return this.store.has(this.keys.page);
  }

  /** Returns for each request of a page whether it needs no network; true also if it is not for a file of the bundle. */
  areKept(page: string, asked: readonly Asked[]): Promise<readonly boolean[]> {
    return Promise.all(asked.map(({ url, range }) => this.isKept(this.plan(url, page), range)));
  }

  private async isKept(plan: Plan, range: string | null): Promise<boolean> {
    if (plan.kind === "manifest") return this.store.has(this.keys.manifest(plan.base));
    if (plan.kind !== "file") return true;
    const { base, path } = plan;
    const listed = await this.listedOf(base);
    if (listed === null) return false;
    if (!Object.hasOwn(listed, path)) return true;
    const { sha256 } = listed[path];
    return [null, range].some((part) => this.store.has(this.keys.file(base, sha256, part)));
  }

  /** Resolves once the ledger of kept files and their last uses is written. */
  save(): Promise<void> {
    return this.store.save();
  }

  private async networkFirst(key: string, request: Request, later: Later): Promise<Response> {
    const kept = await this.store.get(key);
    const coming = fetch(request).then((response) => {
      if (response.ok) later(this.keep(key, response.clone()));
      return response;
    });
    if (kept === null) return coming;
    later(coming.catch(() => undefined)); // may arrive after the kept copy was sent, and then serves the next visit
    const orKept = coming.then(
      (response) => (response.status >= FIRST_SERVER_FAULT ? kept : response),
      () => kept,
    );
    const impatience = new Promise<Response>((resolve) => {
      setTimeout(() => resolve(kept), PATIENCE_MS);
    });
    return Promise.race([orKept, impatience]);
  }

  private async asset(key: string, request: Request, later: Later): Promise<Response> {
    const kept = await this.store.get(key);
    if (kept !== null) return kept;
    const response = await fetch(request);
    if (response.ok) later(this.keep(key, response.clone()));
    return response;
  }

  private async keep(key: string, response: Response): Promise<void> {
    if (!response.ok) return;
    const body = await response.arrayBuffer();
    await this.store.put(key, { body, type: response.headers.get("Content-Type") });
  }

  private async manifest(base: string, request: Request, later: Later): Promise<Response> {
    const response = await this.networkFirst(this.keys.manifest(base), request, later);
    if (response.ok) {
      const listed = this.readListed(base, await response.clone().text());
      this.listed.set(base, listed);
      later(listed);
    }
    return response;
  }

  private async file(
    base: string,
    path: string,
    request: Request,
    later: Later,
  ): Promise<Response> {
    const range = request.headers.get("Range");
    const listed = await this.listedOf(base);
    if (listed === null) {
      this.unlisted.set(`${request.url} ${range}`, { url: request.url, range });
      return fetch(request);
    }
    const ref = Object.hasOwn(listed, path) ? listed[path] : undefined;
    if (ref === undefined || !isKept({ path, ...ref })) return fetch(request);
    const isReload = request.cache === "reload"; // the page found a wrong hash in the kept file
    const part =
      range === null ? null : await this.store.get(this.keys.file(base, ref.sha256, range));
    const kept = part ?? (await this.store.get(this.keys.file(base, ref.sha256)));
    if (kept !== null && !isReload) return kept; // a whole file may answer a request for a range, as HTTP allows
    const response = await fetch(request);
    if (response.ok) later(this.keepFile(base, { path, ...ref }, range, response.clone()));
    return response;
  }

  /** Keeps a file, or a part of it, if it agrees with files.json. The page reports any other file. */
  private async keepFile(
    base: string,
    ref: FileRef,
    range: string | null,
    response: Response,
  ): Promise<void> {
    const body = await response.arrayBuffer();
    const type = response.headers.get("Content-Type");
    if (response.status !== 206) {
      await checkFile(ref, new Uint8Array(body));
      await this.store.put(this.keys.file(base, ref.sha256), { body, type });
      return;
    }
    const [, first, last] = /^bytes=(\d+)-(\d+)$/.exec(range ?? "") ?? [];
    if (first === undefined || body.byteLength !== Number(last) - Number(first) + 1) return;
    const found = `bytes ${first}-${last}/${ref.bytes}`;
    if (response.headers.get("Content-Range") !== found) return;
    await this.store.put(this.keys.file(base, ref.sha256, range), { body, type, range: found });
  }

  /** Returns a bundle's files; after a restart of the worker, from the kept manifest. The result null is not stored. */
  private async listedOf(base: string): Promise<Listed | null> {
    let listed = this.listed.get(base);
    if (listed === undefined) {
      listed = this.store
        .get(this.keys.manifest(base))
        .then(async (kept) => (kept === null ? null : this.readListed(base, await kept.text())));
      this.listed.set(base, listed);
    }
    const found = await listed;
    if (found === null && this.listed.get(base) === listed) this.listed.delete(base);
    return found;
  }

  /** Fetches files.json if it is not kept, and drops files that it no longer lists. */
  private async readListed(base: string, manifest: string): Promise<Listed | null> {
    try {
      const { files } = JSON.parse(manifest) as { files: FileRef };
      const key = this.keys.file(base, files.sha256);
      const kept = await this.store.get(key);
      if (kept !== null) return (await kept.json()) as Listed;
      const response = await fetch(fileAddress(base, files.path));
      const body = await response.arrayBuffer();
      await checkFile(files, new Uint8Array(body));
      const listed = JSON.parse(new TextDecoder().decode(body)) as Listed;
      await this.store.put(key, { body, type: response.headers.get("Content-Type") });
      const hashes = new Set([files.sha256, ...Object.values(listed).map(({ sha256 }) => sha256)]);
      await this.store.retain(this.keys.files(base), (each) => hashes.has(this.keys.hashOf(each)));
      return listed;
    } catch {
      return null; // no file of an unreadable bundle is kept; the page reports the fault
    }
  }
}

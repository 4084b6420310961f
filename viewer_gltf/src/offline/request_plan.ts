/**
 * How the service worker answers a request, by address alone. Pure, so that tests need no worker.
 *
 * Hashed files never change under their name and come from the store first; what may change under
 * its name (the page, the manifest, the icons) comes from the network first.
 */
import { bundleAddress, sourceAddress } from "../bundle/address";
import { BundleError } from "../bundle/errors";
import type { FileRef } from "../bundle/generated/bundle";

export type Plan =
  | { kind: "page" }
  | { kind: "asset"; name: string }
  | { kind: "fixed"; name: string }
  | { kind: "manifest"; base: string }
  | { kind: "file"; base: string; path: string }
  | { kind: "none" };

/** Largest file for a phone's own viewer of augmented reality that is kept: no page draws it. */
export const MAX_KEPT_USDZ_BYTES = 4 * 1024 * 1024;

/** Whether a bundle's file is kept for a visit without a network; null: there is none. */
export function isKept(file: Pick<FileRef, "path" | "bytes"> | null): boolean {
  if (file === null) return false;
  return !file.path.endsWith(".usdz") || file.bytes <= MAX_KEPT_USDZ_BYTES;
}

const NONE: Plan = { kind: "none" };
const ASSETS = "assets/";
const MANIFEST = "manifest.json";

/** The bundle that a page shows, if it lies on the page's own host; otherwise null. */
export function ownBundle(page: string): string | null {
  if (!/^https?:/.test(page)) return null; // a worker made from a blob asks too
  try {
    if (sourceAddress(page) !== null) return null;
    const base = bundleAddress(page);
    return new URL(base).origin === new URL(page).origin ? base : null;
  } catch (error) {
    if (error instanceof BundleError) return null;
    throw error;
  }
}

/** The decoded path below a folder, or null if it lies elsewhere. */
function below(folder: string, url: URL): string | null {
  const { origin, pathname } = new URL(folder);
  if (url.origin !== origin || !url.pathname.startsWith(pathname)) return null;
  try {
    return decodeURIComponent(url.pathname.slice(pathname.length));
  } catch {
    return null; // malformed
  }
}

/**
 * @param folder the viewer's, with a closing slash
 * @param page address of the page that asks; null while it is being opened
 * @param fixed the viewer's files outside assets/, such as its icons
 */
export function planFor(
  address: string,
  folder: string,
  page: string | null,
  fixed: readonly string[],
): Plan {
  const url = new URL(address);
  const inside = below(folder, url);
  if (page === null) return inside === "" || inside === "index.html" ? { kind: "page" } : NONE;
  if (inside?.startsWith(ASSETS)) return { kind: "asset", name: inside };
  if (inside !== null && fixed.includes(inside)) return { kind: "fixed", name: inside };
  const base = ownBundle(page);
  const path = base === null ? null : below(base, url);
  if (base === null || path === null || path === "") return NONE;
  return path === MANIFEST ? { kind: "manifest", base } : { kind: "file", base, path };
}

/** Addresses under which the store keeps things; none of them is ever fetched. */
export class Keys {
  constructor(private readonly folder: string) {}

  private make(...parts: readonly string[]): string {
    return `${this.folder}kept/${parts.map(encodeURIComponent).join("/")}`;
  }

  get page(): string {
    return this.make("page");
  }

  get ledger(): string {
    return this.make("ledger");
  }

  /** Of the viewer. */
  asset(name: string): string {
    return this.make("viewer", name);
  }

  manifest(base: string): string {
    return this.make("bundle", base, MANIFEST);
  }

  /** Start of the keys of a bundle's files. */
  files(base: string): string {
    return `${this.make("bundle", base, "sha256")}/`;
  }

  /** @param range the request's Range header, for a part of the file */
  file(base: string, sha256: string, range: string | null = null): string {
    const part = range === null ? "" : `?${encodeURIComponent(range)}`;
    return `${this.files(base)}${sha256}${part}`;
  }

  /** The hash in a key of `files`. */
  hashOf(key: string): string {
    return key.split("/").at(-1)?.split("?")[0] ?? "";
  }
}

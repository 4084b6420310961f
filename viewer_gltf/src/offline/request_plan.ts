/**
 * Decides by a request's address alone how the service worker answers it. Pure, so that tests need no worker.
 *
 * Files with a hash in their name never change, and come from the store first. Files that may change under the same
 * name (the page, the manifest, the icons) come from the network first.
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

/** Largest USDZ file that is kept, bytes. It is for a phone's own viewer of augmented reality, and no page draws it. */
export const MAX_KEPT_USDZ_BYTES = 4 * 1024 * 1024;

/** Returns whether a bundle's file is kept for a visit without a network; false for null, which means no file. */
export function isKept(file: Pick<FileRef, "path" | "bytes"> | null): boolean {
  if (file === null) return false;
  return !file.path.endsWith(".usdz") || file.bytes <= MAX_KEPT_USDZ_BYTES;
}

const NONE: Plan = { kind: "none" };
const ASSETS = "assets/";
const MANIFEST = "manifest.json";

/** Returns the address of the bundle that a page shows if it is on the page's own host; otherwise null. */
export function ownBundle(page: string): string | null {
  if (!/^https?:/.test(page)) return null; // requests also come from workers that were made from a blob
  try {
    if (sourceAddress(page) !== null) return null;
    const base = bundleAddress(page);
    return new URL(base).origin === new URL(page).origin ? base : null;
  } catch (error) {
    if (error instanceof BundleError) return null;
    throw error;
  }
}

/** Returns the decoded path of a URL below a folder; null if it is elsewhere. */
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
 * Returns how the worker answers a request.
 *
 * @param folder the viewer's folder, with a closing slash
 * @param page address of the page that makes the request; null if the request opens a page
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

/** Keys of the store. They are addresses that are never fetched. */
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

  /** The key of one of the viewer's own files. */
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

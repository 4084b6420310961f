/** The state of the inbox that the server reports: all items, and the rights of this page. Pure. */

import { ITEM_STATES } from "../bundle/generated/item_states";
import { inPageWords } from "./page_words";

export type Doing = (typeof ITEM_STATES)[number];

/** One image that was added to the inbox, as files or as an address. */
export type Item = Readonly<{
  id: string;
  title: string;
  doing: Doing;
  /** Reason of a failure, or another message of the server; empty: there is none. */
  line: string;
  /** Number of bytes that have arrived, and of all bytes of the upload. */
  bytes: number;
  total: number;
  /** Whether the item waits until the server has read another item. */
  waits: boolean;
  /** Position in the queue of builds, from 1; 0: the item is not in the queue. */
  place: number;
  /** Finished share of the build, 0..1. */
  share: number;
  /** The running part of the build, as `units`; or empty. */
  label: string;
  /** Tiles that have their surfaces, and all tiles. */
  tiles: number;
  allTiles: number;
  /** Time until the end of the build, s; null: not known. */
  left_s: number | null;
  /** Folder of the item's view, below this page; empty: it has none. */
  page: string;
  /** Whether the files state no voxel spacing, so that the user has to enter it. */
  asksSpacing: boolean;
  hasUpload: boolean;
  keepsUpload: boolean;
}>;

/**
 * The limits of one item, in bytes and files. A request has at most `piece` bytes. The server keeps an unfinished
 * upload for this number of `hours`.
 */
export type Limits = Readonly<{
  bytes: number;
  files: number;
  piece: number;
  freeBytes: number;
  hours: number;
}>;

export type InboxState = Readonly<{
  items: readonly Item[];
  limits: Limits;
  mayUpload: boolean;
}>;

type Found = Readonly<Record<string, unknown>>;

/** Reads a message of the server; null: this page does not know such messages. */
export function readInboxState(text: string): InboxState | null {
  let found: Found;
  try {
    found = JSON.parse(text);
  } catch {
    return null;
  }
  if (!Array.isArray(found?.items)) return null;
  const limits = (found.limits ?? {}) as Found;
  return {
    items: found.items.flatMap((each: Found) => readItem(each) ?? []),
    limits: {
      bytes: positive(limits.bytes, Number.POSITIVE_INFINITY),
      files: positive(limits.files, Number.POSITIVE_INFINITY),
      piece: positive(limits.piece, 2 ** 20),
      freeBytes: positive(limits.free_bytes, Number.POSITIVE_INFINITY),
      hours: positive(limits.hours, 0),
    },
    mayUpload: found.may_upload === true,
  };
}

function readItem(found: Found): Item | null {
  const doing = ITEM_STATES.find((each) => each === found?.doing);
  const id = textOf(found?.id);
  if (doing === undefined || !/^[\w-]+$/.test(id)) return null;
  return {
    id,
    doing,
    title: textOf(found.title),
    line: inPageWords(textOf(found.line)),
    bytes: positive(found.bytes, 0),
    total: positive(found.total, 0),
    waits: found.waits === true,
    place: positive(found.place, 0),
    share: Math.min(1, positive(found.share, 0)),
    label: textOf(found.label),
    tiles: positive(found.tiles, 0),
    allTiles: positive(found.all_tiles, 0),
    left_s: typeof found.left_s === "number" ? found.left_s : null,
    page: pageOf(found.page),
    asksSpacing: found.asks === "spacing_um",
    hasUpload: found.has_upload === true && found.total !== 0, // an address has no size
    keepsUpload: found.keep_upload === true,
  };
}

/** Returns the folder of an item; empty: the text leads to another place, and is ignored. */
export function pageOf(found: unknown): string {
  const page = textOf(found);
  return /^items\/[\w-]+\/([\w-]+\/)*$/.test(page) ? page : "";
}

export function textOf(found: unknown): string {
  return typeof found === "string" ? found : "";
}

export function positive(found: unknown, otherwise: number): number {
  return typeof found === "number" && found >= 0 ? found : otherwise;
}

/** The actions that a user may take on an item, which depend on its state. Pure. */
import type { Item } from "./inbox_state";
import type { Progress } from "./upload";

export type ActionName =
  | "look"
  | "open"
  | "build"
  | "pause"
  | "continue"
  | "cancel"
  | "retry"
  | "go-on"
  | "delete";

export type Action = Readonly<{
  name: ActionName;
  label: string;
  /** Whether this is the action that most users want next. */
  isPrimary?: boolean;
}>;

export type Situation = Readonly<{
  /** The upload of this item by this page; null: this page does not upload it. */
  upload: Progress | null;
  mayUpload: boolean;
  /** Whether the browser can read the files of an unfinished upload again. */
  hasHandles: boolean;
  /** Whether another page is uploading this item. */
  isMoving: boolean;
  /** Whether the server has made a summary of this item. */
  isUnderstood: boolean;
}>;

const DELETE: Action = { name: "delete", label: "Delete" };
const LOOK: Action = { name: "look", label: "Preview" };
const BUILD: Action = { name: "build", label: "Build", isPrimary: true };

export function actionsOf(item: Item, situation: Situation): readonly Action[] {
  const open: readonly Action[] =
    item.page === "" ? [] : [{ name: "open", label: openLabel(item), isPrimary: isBuilt(item) }];
  if (!situation.mayUpload) return open;
  switch (item.doing) {
    case "uploading":
      return uploadActions(situation);
    case "understood":
      return [LOOK, BUILD, DELETE];
    case "cancelled":
    case "failed":
      // the card asks for a missing voxel spacing
      return situation.isUnderstood && !item.asksSpacing
        ? [LOOK, { ...BUILD, label: "Build again" }, DELETE]
        : [DELETE];
    case "queued":
      return [
        ...(open.length > 0 ? open : [LOOK]),
        { name: "cancel", label: "Leave the queue" },
        DELETE,
      ];
    case "building":
      return [
        ...open,
        { name: "pause", label: "Pause" },
        { name: "cancel", label: "Cancel" },
        DELETE,
      ];
    case "paused":
      return [
        ...open,
        { name: "continue", label: "Continue", isPrimary: true },
        { name: "cancel", label: "Cancel" },
        DELETE,
      ];
    case "built":
      return [...open, DELETE];
    default:
      return [DELETE];
  }
}

function uploadActions({ upload, hasHandles, isMoving }: Situation): readonly Action[] {
  const cancel: Action = { name: "delete", label: "Cancel the upload" };
  if (upload?.doing === "lost")
    return [{ name: "retry", label: "Try now", isPrimary: true }, cancel];
  if (upload !== null || isMoving) return [cancel];
  const goOn: Action = { name: "go-on", label: "Continue the upload", isPrimary: true };
  return hasHandles ? [goOn, DELETE] : [DELETE];
}

const isBuilt = ({ doing }: Item) => doing === "built";
const openLabel = (item: Item) => (isBuilt(item) ? "Open" : "Preview");

/** Returns whether the settings of an item can still be changed. */
export function canChoose({ doing }: Item): boolean {
  return ["understanding", "understood", "failed", "cancelled"].includes(doing);
}

/** Returns whether the server has tried to read an item, and so has a summary or an error. */
export function isRead({ doing }: Item): boolean {
  return !["uploading", "unpacking", "understanding"].includes(doing);
}

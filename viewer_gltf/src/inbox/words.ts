/** States of an item in words. Pure. */
import { leftWords, partWords } from "../live/build_state";
import type { Item, Limits } from "./inbox_state";
import type { Progress } from "./upload";

const UNITS = ["bytes", "kB", "MB", "GB", "TB"];

/** Bytes for people, as `1.2 GB`. */
export function bytesText(bytes: number): string {
  const power = bytes < 1000 ? 0 : Math.min(UNITS.length - 1, Math.floor(Math.log10(bytes) / 3));
  const value = bytes / 1000 ** power;
  const digits = power > 0 && value < 10 ? 1 : 0;
  return `${value.toFixed(digits)} ${UNITS[power]}`;
}

/** A word or two for the state, as a badge shows it. The arguments are those of `wordsOf`. */
export function stateName(
  { doing, place, waits }: Item,
  upload: Progress | null,
  isMoving: boolean,
): string {
  if (doing === "uploading") {
    if (upload === null) return isMoving ? "Uploading" : "Unfinished";
    const names = { lost: "No connection", waiting: "Waiting", refused: "Stopped" };
    return names[upload.doing as keyof typeof names] ?? "Uploading";
  }
  if (waits) return "Waiting";
  if (doing === "queued") return place > 0 ? `In the queue: ${place}` : "In the queue";
  return {
    unpacking: "Checking",
    understanding: "Reading",
    understood: "Ready",
    failed: "Stopped",
    building: "Building",
    paused: "Paused",
    cancelled: "Cancelled",
    built: "Built",
  }[doing];
}

/**
 * The state in a sentence.
 *
 * @param upload the upload that this page runs; null: it runs none
 * @param isMoving whether bytes arrive from elsewhere
 */
export function wordsOf(
  item: Item,
  upload: Progress | null,
  isMoving: boolean,
  { hours }: Pick<Limits, "hours">,
): string {
  if (item.waits) return "It waits until the image before it has been read.";
  switch (item.doing) {
    case "uploading":
      if (upload !== null) return uploadWords(upload);
      if (isMoving) return `${arrivedText(item)} have arrived from another page.`;
      return (
        `${arrivedText(item)} have arrived. Drop the same files again to go on.` +
        (hours > 0 ? ` An unfinished upload is deleted after ${hoursText(hours)}.` : "")
      );
    case "unpacking":
      return "The files are being checked, and unpacked if they are an archive.";
    case "understanding":
      return "The image is being read. This takes a few seconds.";
    case "understood":
      return item.line || "Look at it now, or check the settings and build it.";
    case "failed":
      return item.line || "This can't be read.";
    case "queued":
      if (item.place > 1)
        return `It is built after ${item.place - 1} other${plural(item.place - 1)}.`;
      return "It is built next.";
    case "building":
      return `${partWords(item.label)}${item.label === "units" ? tilesText(item) : ""}${leftWords(item.left_s)}.`;
    case "paused":
      return `Paused${tilesText(item)}. What is finished is kept.`;
    case "cancelled":
      return "The build was cancelled.";
    case "built":
      return item.line || builtWords(item);
  }
}

function builtWords({ hasUpload }: Item): string {
  return hasUpload ? "All surfaces are built. The upload is kept." : "All surfaces are built.";
}

const plural = (count: number) => (count === 1 ? "" : "s");
const hoursText = (hours: number) =>
  hours >= 48 ? `${Math.round(hours / 24)} days` : `${hours} hour${plural(hours)}`;
const arrivedText = ({ bytes, total }: Pick<Item, "bytes" | "total">) =>
  `${bytesText(bytes)} of ${bytesText(total)}`;

function tilesText({ tiles, allTiles }: Item): string {
  return allTiles > 0 ? `: ${tiles} of ${allTiles} ${allTiles === 1 ? "tile" : "tiles"}` : "";
}

function uploadWords({ doing, sent, total, left_s, line }: Progress): string {
  const arrived = arrivedText({ bytes: sent, total });
  switch (doing) {
    case "waiting":
      return `It waits for the upload before it. ${arrived} have arrived.`;
    case "lost":
      return `${line || "The connection is lost."} ${arrived} are safe; the page goes on by itself as soon as it can.`;
    case "refused":
      return line;
    case "cancelled":
      return "The upload is being cancelled.";
    case "complete":
      return "All bytes have arrived.";
    case "sending":
      return `${arrived}${leftWords(left_s)}. Keep this page open.`;
  }
}

/** How much of the upload or the build is done, 0..1; null: nothing that can be measured is under way. */
export function shareOf(item: Item, upload: Progress | null): number | null {
  const { doing, bytes, total, share } = item;
  if (doing === "uploading") return total > 0 ? Math.max(bytes, upload?.sent ?? 0) / total : 0;
  return doing === "building" || doing === "paused" ? share : null;
}

/** What is lost if an item is deleted, as the question before says it. */
export function deletionWords({ doing, hasUpload, total, page }: Item): string {
  const upload = total > 0 ? `the upload (${bytesText(total)})` : "the upload";
  const parts = [
    ...(doing === "uploading" ? ["what has arrived of the upload"] : hasUpload ? [upload] : []),
    ...(doing === "built"
      ? ["the built specimen, with its page"]
      : doing === "building" || doing === "paused" || doing === "queued"
        ? ["the build, which is stopped"]
        : page === ""
          ? []
          : ["the look"]),
  ];
  const what = parts.length === 0 ? "the entry in this list" : parts.join(" and ");
  return `This deletes ${what} from the server. Your own files stay as they are. It can't be undone.`;
}

/** Why these files can't be handed in; null: nothing speaks against it. */
export function refusalOf(files: number, bytes: number, limits: Limits): string | null {
  if (files === 0) return "There is no file in it. Drop the files or the folder of one image.";
  if (files > limits.files) {
    return `These are ${files} files, and this server takes at most ${limits.files} at once. Zip the folder, and drop that.`;
  }
  if (bytes > limits.bytes) {
    return `These are ${bytesText(bytes)}, and this server takes at most ${bytesText(limits.bytes)} at once.`;
  }
  if (bytes > limits.freeBytes) {
    return `These are ${bytesText(bytes)}, and the server has ${bytesText(limits.freeBytes)} left. Delete what is no longer needed.`;
  }
  return null;
}

/** Texts for the state of an item. Pure. */
import { leftWords, partWords } from "../live/build_state";
import type { Item, Limits } from "./inbox_state";
import type { Progress } from "./upload";

const UNITS = ["bytes", "kB", "MB", "GB", "TB"];

/** Writes a number of bytes with a unit, such as `1.2 GB`. */
export function bytesText(bytes: number): string {
  const power = bytes < 1000 ? 0 : Math.min(UNITS.length - 1, Math.floor(Math.log10(bytes) / 3));
  const value = bytes / 1000 ** power;
  const digits = power > 0 && value < 10 ? 1 : 0;
  return `${value.toFixed(digits)} ${UNITS[power]}`;
}

/** Returns the state in a few words, for a badge. The arguments are those of `wordsOf`. */
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
  if (doing === "queued") return place > 0 ? `Number ${place} in the queue` : "In the queue";
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
 * Returns the state in a sentence.
 *
 * @param upload the upload of this item by this page; null: this page does not upload it
 * @param isMoving whether another page is uploading the item
 */
export function wordsOf(
  item: Item,
  upload: Progress | null,
  isMoving: boolean,
  { hours }: Pick<Limits, "hours">,
): string {
  if (item.waits) return "This image waits until the image before it has been read.";
  switch (item.doing) {
    case "uploading":
      if (upload !== null) return uploadWords(upload);
      if (isMoving) return `${arrivedText(item)} have arrived from another page.`;
      return (
        `${arrivedText(item)} have arrived. Drop the same files again to continue.` +
        (hours > 0 ? ` An unfinished upload is deleted after ${hoursText(hours)}.` : "")
      );
    case "unpacking":
      return "The files are being checked, and unpacked if they are an archive.";
    case "understanding":
      return "The image is being read. This takes a few seconds.";
    case "understood":
      return item.line || "Open a preview, or check the settings and build the image.";
    case "failed":
      return item.line || "This image can't be read.";
    case "queued":
      if (item.place > 1)
        return `This image is built after ${item.place - 1} other${plural(item.place - 1)}.`;
      return "This image is built next.";
    case "building":
      return `${partWords(item.label)}${item.label === "units" ? tilesText(item) : ""}${leftWords(item.left_s)}.`;
    case "paused":
      return `Paused${tilesText(item)}. Finished parts are kept.`;
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
      return `This upload waits for the one before it. ${arrived} have arrived.`;
    case "lost":
      return `${line || "The connection is lost."} ${arrived} are safe. The page continues by itself as soon as it can.`;
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

/** Returns the finished share of the upload or the build, 0..1; null: neither of them is under way. */
export function shareOf(item: Item, upload: Progress | null): number | null {
  const { doing, bytes, total, share } = item;
  if (doing === "uploading") return total > 0 ? Math.max(bytes, upload?.sent ?? 0) / total : 0;
  return doing === "building" || doing === "paused" ? share : null;
}

/** Returns the text of the question before an item is deleted: it lists everything that would be lost. */
export function deletionWords({ doing, hasUpload, total, page }: Item): string {
  const upload = total > 0 ? `the upload (${bytesText(total)})` : "the upload";
  const parts = [
    ...(doing === "uploading" ? ["the unfinished upload"] : hasUpload ? [upload] : []),
    ...(doing === "built"
      ? ["the built specimen, with its page"]
      : doing === "building" || doing === "paused" || doing === "queued"
        ? ["the unfinished build"]
        : page === ""
          ? []
          : ["the preview"]),
  ];
  const what = parts.length === 0 ? "the entry in this list" : parts.join(" and ");
  return `This deletes ${what} from the server and can't be undone. Your own files stay as they are.`;
}

/** Returns why these files can't be uploaded; null: they can. */
export function refusalOf(files: number, bytes: number, limits: Limits): string | null {
  if (files === 0) return "No files were found. Drop the files or the folder of one image.";
  if (files > limits.files) {
    return `The image has ${files} files, but this server takes at most ${limits.files} at once. Zip the folder and drop the zip file.`;
  }
  if (bytes > limits.bytes) {
    return `The image has ${bytesText(bytes)}, but this server takes at most ${bytesText(limits.bytes)} at once.`;
  }
  if (bytes > limits.freeBytes) {
    return `The image has ${bytesText(bytes)}, but the server has only ${bytesText(limits.freeBytes)} left. Delete images that are no longer needed.`;
  }
  return null;
}

import { describe, expect, it } from "vitest";
import { type ActionName, actionsOf } from "./actions";
import type { Item } from "./inbox_state";
import type { Progress } from "./upload";
import { bytesText, deletionWords, refusalOf, shareOf, stateName, wordsOf } from "./words";

const item = (changes: Partial<Item>): Item => ({
  ...{ id: "a1", title: "Head", doing: "understood", line: "", bytes: 0, total: 0, place: 0 },
  ...{ share: 0, label: "", tiles: 0, allTiles: 0, left_s: null, page: "" },
  ...{ hasUpload: true, keepsUpload: false, asksSpacing: false, waits: false },
  ...changes,
});
const upload = (changes: Partial<Progress>): Progress => ({
  ...{ doing: "sending", sent: 312e6, total: 1.2e9, left_s: null, line: "" },
  ...changes,
});
const LIMITS = { bytes: 2e9, files: 1000, piece: 8e6, freeBytes: 3e9, hours: 24 };
const VIEW = "items/a1/view/";
const UPLOADING = item({ doing: "uploading", bytes: 312e6, total: 1.2e9 });

describe("a number of bytes", () => {
  it.each([
    [0, "0 bytes"],
    [999, "999 bytes"],
    [1000, "1.0 kB"],
    [312e6, "312 MB"],
    [1.24e9, "1.2 GB"],
    [5e15, "5000 TB"],
  ])("of %d is written as %s", (bytes, text) => expect(bytesText(bytes)).toBe(text));
});

it("shows that an image waits for the one before it", () => {
  const waiting = item({ doing: "understanding", waits: true });
  expect(stateName(waiting, null, false)).toBe("Waiting");
  expect(wordsOf(waiting, null, false, LIMITS)).toBe(
    "This image waits until the image before it has been read.",
  );
});

describe("the sentence about an upload of this page", () => {
  it.each([
    [{}, "312 MB of 1.2 GB. Keep this page open."],
    [{ left_s: 41 }, "312 MB of 1.2 GB, about 45 s left. Keep this page open."],
    [
      { doing: "waiting" },
      "This upload waits for the one before it. 312 MB of 1.2 GB have arrived.",
    ],
    [
      { doing: "lost" },
      "The connection is lost. 312 MB of 1.2 GB are safe. The page continues by itself as soon as it can.",
    ],
    [{ doing: "refused", line: "The disk is full." }, "The disk is full."],
  ] as const)("%o", (changes, words) => {
    expect(wordsOf(UPLOADING, upload(changes), false, LIMITS)).toBe(words);
  });
});

describe("the sentence about an item of the inbox", () => {
  it.each([
    [
      UPLOADING,
      "312 MB of 1.2 GB have arrived. Drop the same files again to continue. An unfinished upload is deleted after 24 hours.",
    ],
    [item({ doing: "queued", place: 1 }), "This image is built next."],
    [item({ doing: "queued", place: 2 }), "This image is built after 1 other."],
    [item({ doing: "queued", place: 4 }), "This image is built after 3 others."],
    [
      item({ doing: "building", label: "units", tiles: 1, allTiles: 4, left_s: 400 }),
      "Building surfaces: 1 of 4 tiles, about 7 min left.",
    ],
    [item({ doing: "building", allTiles: 4 }), "Planning the build."],
    [item({ doing: "building", label: "stage", tiles: 4, allTiles: 4 }), "Writing the stage."],
    [
      item({ doing: "paused", tiles: 1, allTiles: 4 }),
      "Paused: 1 of 4 tiles. Finished parts are kept.",
    ],
    [item({ doing: "failed", line: "a.tif: cut off" }), "a.tif: cut off"],
    [item({ doing: "failed" }), "This image can't be read."],
    [item({ doing: "built" }), "All surfaces are built. The upload is kept."],
    [item({ doing: "built", hasUpload: false }), "All surfaces are built."],
  ])("%o", (shown, words) => expect(wordsOf(shown, null, false, LIMITS)).toBe(words));

  it("distinguishes an upload by another page from an abandoned one", () => {
    expect(wordsOf(UPLOADING, null, true, LIMITS)).toBe(
      "312 MB of 1.2 GB have arrived from another page.",
    );
    expect(stateName(UPLOADING, null, false)).toBe("Unfinished");
    expect(stateName(UPLOADING, null, true)).toBe("Uploading");
    expect(stateName(UPLOADING, upload({ doing: "lost" }), false)).toBe("No connection");
  });

  it("has beside it the finished share of the upload or the build", () => {
    expect(shareOf(UPLOADING, null)).toBeCloseTo(0.26);
    expect(shareOf(UPLOADING, upload({ sent: 600e6 }))).toBe(0.5);
    expect(shareOf(item({ doing: "building", share: 0.4 }), null)).toBe(0.4);
    expect(shareOf(item({}), null)).toBeNull();
  });
});

describe("the actions that a user is offered for an item", () => {
  const can = (shown: Item, changes = {}): readonly ActionName[] =>
    actionsOf(shown, {
      ...{ upload: null, mayUpload: true, hasHandles: false, isMoving: false, isUnderstood: false },
      ...changes,
    }).map(({ name }) => name);

  it.each([
    [item({ doing: "unpacking" }), ["delete"]],
    [item({}), ["look", "build", "delete"]],
    [item({ doing: "queued" }), ["look", "cancel", "delete"]],
    [item({ doing: "building", page: VIEW }), ["open", "pause", "cancel", "delete"]],
    [item({ doing: "paused" }), ["continue", "cancel", "delete"]],
    [item({ doing: "cancelled" }), ["delete"]],
    [item({ doing: "failed" }), ["delete"]],
    [item({ doing: "built", page: VIEW }), ["open", "delete"]],
  ] as const)("%o", (shown, names) => expect(can(shown)).toEqual(names));

  it("depend on whether this page or this browser still has the files", () => {
    expect(can(UPLOADING)).toEqual(["delete"]);
    expect(can(UPLOADING, { hasHandles: true })).toEqual(["go-on", "delete"]);
    expect(can(UPLOADING, { hasHandles: true, isMoving: true })).toEqual(["delete"]);
    expect(can(UPLOADING, { upload: upload({ doing: "lost" }) })).toEqual(["retry", "delete"]);
    for (const doing of ["failed", "cancelled"] as const) {
      const names = ["look", "build", "delete"];
      expect(can(item({ doing }), { isUnderstood: true })).toEqual(names);
      const asking = item({ doing, asksSpacing: true });
      expect(can(asking, { isUnderstood: true })).toEqual(["delete"]);
    }
  });

  it("are only to open a page if the user has no right to upload", () => {
    for (const doing of ["understood", "building", "built"] as const) {
      expect(can(item({ doing }), { mayUpload: false })).toEqual([]);
      expect(can(item({ doing, page: VIEW }), { mayUpload: false })).toEqual(["open"]);
    }
  });
});

describe("the question before a deletion", () => {
  it.each([
    [UPLOADING, "the unfinished upload"],
    [item({ total: 1.2e9 }), "the upload (1.2 GB)"],
    [item({ total: 1.2e9, page: VIEW }), "the upload (1.2 GB) and the preview"],
    [item({ doing: "building", page: VIEW, hasUpload: false }), "the unfinished build"],
    [
      item({ doing: "built", total: 1.2e9, page: VIEW }),
      "the upload (1.2 GB) and the built specimen, with its page",
    ],
    [item({ doing: "failed", hasUpload: false }), "the entry in this list"],
  ])("%o", (shown, what) => {
    expect(deletionWords(shown)).toBe(
      `This deletes ${what} from the server and can't be undone. Your own files stay as they are.`,
    );
  });
});

describe("files that are dropped for an upload", () => {
  it.each([
    [0, 0, /^No files were found/],
    [1001, 10, /1001 files, but this server takes at most 1000/],
    [3, 2.5e9, /2\.5 GB, but this server takes at most 2\.0 GB/],
  ])("are refused if there are none or too many: %d files, %d bytes", (files, bytes, words) => {
    expect(refusalOf(files, bytes, LIMITS)).toMatch(words);
  });

  it("are refused if the disk lacks room, and accepted otherwise", () => {
    expect(refusalOf(1, 1e9, { ...LIMITS, freeBytes: 5e8 })).toMatch(/has only 500 MB left/);
    expect(refusalOf(1000, 2e9, LIMITS)).toBeNull();
  });
});

import { describe, expect, it } from "vitest";
import { type InboxState, readInboxState } from "./inbox_state";
import { readUnderstood } from "./understood";

const ITEM = {
  ...{ id: "a1", title: "Head", doing: "building", line: "", bytes: 10, total: 10, place: 0 },
  ...{ share: 0.4, label: "units", tiles: 1, all_tiles: 4, left_s: 30, page: "items/a1/view/" },
  ...{ has_upload: true, keep_upload: false, asks: "", waits: true },
};
const LIMITS = { bytes: 100, files: 5, piece: 8, free_bytes: 70, hours: 24 };
const read = (items: unknown[], more = {}) =>
  readInboxState(
    JSON.stringify({ items, limits: LIMITS, may_upload: true, ...more }),
  ) as InboxState;

describe("a message of the server", () => {
  it("is read by the names of its fields", () => {
    expect(read([ITEM])).toEqual({
      mayUpload: true,
      limits: { bytes: 100, files: 5, piece: 8, freeBytes: 70, hours: 24 },
      items: [
        {
          ...{ id: "a1", title: "Head", doing: "building", line: "", bytes: 10, total: 10 },
          ...{ place: 0, share: 0.4, label: "units", tiles: 1, allTiles: 4, left_s: 30 },
          ...{ page: "items/a1/view/", hasUpload: true, keepsUpload: false },
          asksSpacing: false,
          waits: true,
        },
      ],
    });
  });

  it("is null if it has another form, drops malformed items, and gives no right unless stated", () => {
    for (const text of ["", "null", "7", "[]", "{", '{"items": 3}']) {
      expect(readInboxState(text), text).toBeNull();
    }
    expect(read([], { may_upload: "yes" }).mayUpload).toBe(false);
    expect(read([{ ...ITEM, doing: "sleeping" }, null, { ...ITEM, id: "../a" }]).items).toEqual([]);
  });

  it("leads to no page outside the item's own folder", () => {
    const elsewhere = ["//host/", "https://host/", "items/../x/", "items/a1/view", "javascript:1"];
    for (const page of elsewhere) expect(read([{ ...ITEM, page }]).items[0].page, page).toBe("");
  });
});

describe("the server's answer about the content of an upload", () => {
  it("has the offered choices, each with the text that is shown", () => {
    const found = readUnderstood({
      format: "OME-TIFF",
      size_voxels: [9, 8, 7],
      slices: [
        { axis: "z", name: "axial", image: "slices/z.png" },
        { axis: "y", image: "../secret.png" },
      ],
      channels: [{ id: "0", name: "DNA", color: "url(x)", has_surface: true }],
      choices: {
        preset: { value: "mri", options: ["mri", "ct"] },
        channels: { value: ["0"], options: [{ id: "0", name: "DNA" }] },
        series: { value: "2", options: [{ id: "2", text: "T1, 180 slices" }] },
        background: null,
        spacing_um: { value: [0.5, 0.5, 2] },
      },
    });
    expect(found.slices).toEqual([{ axis: "z", name: "axial", image: "slices/z.png" }]);
    expect(found.channels).toEqual([{ id: "0", name: "DNA", color: "", hasSurface: true }]);
    expect(found.preset?.options.map(({ text }) => text)).toEqual(["mri", "ct"]);
    expect(found.series?.options).toEqual([{ id: "2", text: "T1, 180 slices" }]);
    expect(found.chosenSpacing_um).toEqual([0.5, 0.5, 2]);
    expect([found.background, found.channelOptions]).toEqual([null, [{ id: "0", text: "DNA" }]]);
  });

  it("is read as an empty content if it has another form", () => {
    for (const answer of [null, 7, [], "x"]) {
      expect(readUnderstood(answer)).toMatchObject({ format: "", slices: [], preset: null });
    }
  });
});

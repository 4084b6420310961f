import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import type { Action } from "./actions";
import { announcementOf } from "./announce_change";
import { initialState } from "./initial_state";
import { reduce } from "./reduce";
import { tileName } from "./tile_name";
import type { ViewerState } from "./viewer_state";

const MANIFEST = sampleManifest(6);
const START = initialState(MANIFEST);
const announcement = (state: ViewerState, action: Action) =>
  announcementOf(state, reduce(state, action), MANIFEST.tiles);

describe("an announcement", () => {
  it("names the channel that was hidden to show another", () => {
    const fifth: Action = { type: "show", channel: "c5", shown: true };
    expect(announcement(START, fifth)).toBe(
      "At most 4 channels can be shown at once: Marker 0 was hidden to show Marker 5.",
    );
    const room = reduce(START, { type: "show", channel: "c2", shown: false });
    expect(announcement(START, { type: "show", channel: "c2", shown: false })).toBeNull();
    expect(announcement(room, fifth)).toBeNull();
  });

  it("reports that the cut removes all of the isolated tile", () => {
    const [{ id: near, bounds_um }] = MANIFEST.tiles;
    const far = MANIFEST.tiles.at(-1)?.id ?? "";
    const cutTo: Action = { type: "set-clip", clip: { box: bounds_um, plane: null } };
    const cut = reduce(START, cutTo);
    const words = `Only ${tileName(far, START.tiles)} is shown, and the cut removes all of it.`;
    expect(announcement(START, cutTo)).toBeNull();
    expect(announcement(cut, { type: "isolate", tile: near })).toBeNull();
    expect(announcement(cut, { type: "isolate", tile: far })).toBe(words);
    const alone = reduce(START, { type: "isolate", tile: far });
    expect(announcement(alone, cutTo)).toBe(words);
    const empty = reduce(alone, cutTo);
    expect(
      announcement(empty, { type: "set", id: "opacity", channel: "c0", value: 0.5 }),
    ).toBeNull();
    expect(announcement(empty, { type: "set-clip", clip: { ...empty.clip } })).toBeNull(); // this was announced before
    expect(announcement(empty, { type: "isolate", tile: null })).toBeNull();
  });
});

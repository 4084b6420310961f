import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { initialState } from "../state/initial_state";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";
import type { Control, Request } from "./controls";
import { type TapCardContent, tapCardOf } from "./tap_card";

const start = initialState(sampleManifest(3));
const [{ id: tile }] = start.tiles;

const labels = ({ controls }: TapCardContent) => controls.map(({ label }) => label);

function pressed(state: ViewerState, control: Control | undefined): ViewerState {
  if (control?.kind !== "button") throw new Error("no button");
  const request: Request = control.to();
  if (typeof request === "string" || "panel" in request) throw new Error("no action");
  return reduce(state, request);
}

describe("the card of a tapped place", () => {
  it("offers to hide the channel, and to show it again", () => {
    const content = tapCardOf(start, { tile, channel: "c0" }, null);
    const { name } = start.channels[0];
    expect(content.title).toBe(name);
    const hide = content.controls.find(({ id }) => id === "tap-hide");
    expect(hide?.label).toBe(`Hide ${name}`);
    const hidden = pressed(start, hide);
    expect(hidden.channels[0].shown).toBe(false);
    expect(labels(tapCardOf(hidden, { tile, channel: "c0" }, null))).toContain(`Show ${name}`);
  });

  it("offers eight colours that no other channel has", () => {
    const { controls } = tapCardOf(start, { tile, channel: "c0" }, null);
    const colours = controls.find(({ kind }) => kind === "colour");
    if (colours?.kind !== "colour") throw new Error("no colours");
    const hexes = colours.palettes.flatMap(({ colors }) => colors.map(({ hex }) => hex));
    expect(new Set(hexes).size).toBe(8);
    for (const { name } of colours.palettes[0].colors) expect(name).not.toBe("");
  });

  it("does not mention tiles if there is only one", () => {
    const alone = { ...start, tiles: start.tiles.slice(0, 1) };
    const { subtitle, controls } = tapCardOf(alone, { tile, channel: "c0" }, null);
    expect(subtitle).toBe("");
    expect(controls.map(({ id }) => id)).not.toContain("tap-isolate");
  });

  it("names an object and its label map, isolates it, and shows all objects again", () => {
    const channels = start.channels.map((each) => ({ ...each, hasObjects: true }));
    const state = { ...start, channels };
    const tapped = { tile, channel: "c0", object: { row: 4, name: "Cell 105" } };
    const content = tapCardOf(state, tapped, null);
    expect([content.title, content.subtitle]).toEqual([
      "Cell 105",
      expect.stringContaining(channels[0].name),
    ]);
    const only = pressed(
      state,
      content.controls.find(({ id }) => id === "tap-only-object"),
    );
    expect(only.objects.c0.only).toEqual([4]);
    const back = tapCardOf(only, tapped, null).controls.find(({ id }) => id === "tap-only-object");
    expect(pressed(only, back).objects.c0.only).toBeNull();
    // the colours come from a column, and a colour of the channel would not change them
    expect(content.controls.some(({ kind }) => kind === "colour")).toBe(false);
  });

  it("undoes the last change, or reports why it cannot", () => {
    const undo = (text: string | null) =>
      tapCardOf(start, { tile, channel: null }, text).controls.find(({ id }) => id === "tap-undo");
    expect(undo("isolated tile")?.label).toBe("Undo: isolated tile");
    expect(undo(null)?.refusal).toMatch(/^[A-Z].*\.$/);
  });
});

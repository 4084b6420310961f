import { describe, expect, it } from "vitest";
import { FLAT_FACTS } from "../../test/support/fixture/facts";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { KEYS } from "../../test/support/panel/all_keys";
import { buildPanel } from "../../test/support/panel/whole_panel";
import { PRESET_TITLES } from "../bundle/generated/preset_titles";
import { UNCHANGED_VIEW } from "../state/commands";
import { initialState } from "../state/initial_state";
import { CHANNEL } from "../state/parameters/channel";
import { allParameters } from "../state/parameters/table";
import { REFUSED } from "../state/refusals";
import type { ViewerState } from "../state/viewer_state";
import { type Control, START_VIEW } from "./controls";
import { CHOICES, explanationOfChoice } from "./explanations";
import { titleOf } from "./transfer_titles";

const start = initialState(sampleManifest(3));
const STATES: readonly ViewerState[] = (["disc", "tile", "all", "traced", "off"] as const).map(
  (mode) => ({ ...start, mode }),
);
const CONTROLS: readonly Control[] = STATES.flatMap((state) =>
  buildPanel(state, FLAT_FACTS, { ...START_VIEW, picked: "c0" })
    .sections.flatMap(({ items }) => items)
    .flatMap((item) => (item.kind === "group" ? [...item.controls, ...item.more] : [item])),
);

describe("the explanations", () => {
  it("are whole sentences", () => {
    const sentences = CONTROLS.flatMap(({ about }) => about ?? []);
    expect(new Set(sentences).size).toBeGreaterThan(20);
    for (const text of sentences) expect(text).toMatch(/^[A-Z0-9].*\.$/);
  });

  it("exist for choices only if their control has an explanation", () => {
    const explained = CONTROLS.filter(({ about }) => about !== undefined);
    const ids = new Set(explained.map(({ id }) => id.slice(id.lastIndexOf("/") + 1)));
    for (const id of Object.keys(CHOICES)) expect(ids, id).toContain(id);
  });

  it("exist for each setting that needs more than its name", () => {
    // The effect of these settings is clear from their names; all others need an `about`.
    const plain =
      /^(color|picture-size|slice-.*|trace-room|trace\/(environment|hue|saturation|lightness|lamp|post).*|lamp-.*)$/;
    const silent = [...allParameters(), ...CHANNEL].filter(({ about }) => !about);
    expect(silent.map(({ id }) => id).filter((id) => !plain.test(id))).toEqual([]);
  });

  it("describe the result of each mode and each transfer function", () => {
    for (const control of CONTROLS) {
      if (control.kind !== "choice" || !(control.id in CHOICES)) continue;
      for (const { value } of control.options) {
        expect(explanationOfChoice(control.id, value), value).toMatch(/^[A-Z].*\.$/);
      }
    }
    const names = Object.keys(PRESET_TITLES);
    expect(names.length).toBeGreaterThan(10);
    for (const name of names) {
      expect(Object.keys(CHOICES["transfer-function"])).toContain(name);
      expect(titleOf(name), name).toMatch(/^[A-Z]/);
      expect(explanationOfChoice("c0/transfer-function", name)).toContain(`"${name}"`);
    }
    expect(new Set(names.map(titleOf)).size).toBe(names.length);
    expect(titleOf("my own")).toBe("my own");
    expect(explanationOfChoice("c0/transfer-function", "my own")).toContain(
      "came with this bundle",
    );
  });
});

describe("the words of the panel", () => {
  /** Terms of the code, and words for which the panel uses those of the field; whole words. */
  const PRIVATE =
    /\b(switch distance|brick|mip|LOD|march\w*|stand-in|request|rung|ladder|quad|texel|anew|once more|by turns|spoilt)\b/i;

  it("are those of the field, without terms of the code", () => {
    const ofControls = CONTROLS.flatMap(({ id: _, ...control }) =>
      [control.label, control.name, control.refusal, control.about]
        .concat(control.kind === "choice" ? control.options.map(({ label }) => label) : [])
        .filter((text) => text !== undefined),
    );
    const ofKeys = KEYS.groups.flatMap(({ name, keys }) => [
      name,
      ...keys.map(({ label }) => label),
    ]);
    const others = [...Object.values(CHOICES), REFUSED, UNCHANGED_VIEW].flatMap((table) =>
      Object.values(table),
    );
    const found = [...ofControls, ...ofKeys, ...others].filter((text) => PRIVATE.test(text));
    expect(found).toEqual([]);
  });
});

import { describe, expect, it } from "vitest";
import { SPECIMEN_BOX, sampleManifest } from "../../test/support/fixture/manifest";
import { MAX_SHAPES, type Shape } from "../bundle/transfer_2d";
import type { Action } from "../state/actions";
import { initialState } from "../state/initial_state";
import { reduce } from "../state/reduce";
import { OWN, shapesOf } from "../state/transfer_functions_2d";
import { makeShape } from "../state/transfer_shapes";
import { readLink, writeLink } from "./permalink";
import { readShapes, writeShapes } from "./shapes_link";

const START = initialState(sampleManifest(12));
const SHAPES: readonly Shape[] = [
  {
    ...makeShape("triangle", { value: 0.31, gradient: 0.6 }),
    tip: 0.234,
    color: [0.2, 1, 0.003],
    opacity: 0.111,
    softness: 0,
  },
  makeShape("rectangle", { value: 0.9, gradient: 0.05 }),
];
const set = (channel: string, name: string, shapes: readonly Shape[]): Action => ({
  type: "set-shapes",
  channel,
  name,
  shapes,
});
const after = (...actions: readonly Action[]) => actions.reduce(reduce, START);
const read = (link: string) => readLink(link, START, SPECIMEN_BOX).actions;

describe("shapes in a link", () => {
  it("are restored, together with the selected function", () => {
    const state = after(set("c0", "soft", [SHAPES[1]]), set("c0", OWN, SHAPES), {
      type: "choose-transfer-function",
      channel: "c0",
      name: "soft",
    });
    const link = writeLink(state, START, null);
    expect(link).toMatch(/^#v=1&l=c0:ssoft_r[0-9a-z]{20}:sown_[0-9a-z]{42}:tsoft$/);
    expect(after(...read(link)).channels).toEqual(state.channels);
    const emptied = after(set("c3", "soft", []));
    expect(after(...read(writeLink(emptied, START, null))).channels).toEqual(emptied.channels);
  });

  it("are left out of a link if they are unchanged", () => {
    expect(writeLink(START, START, null)).toBe("#v=1");
  });

  it("are left out if there are too many, beginning with those that do not show", () => {
    const many = Array.from({ length: MAX_SHAPES }, () => SHAPES[0]);
    const state = after(
      ...START.channels.flatMap(({ id }) => [set(id, "soft", many), set(id, OWN, many)]),
    );
    const link = writeLink(state, START, null);
    expect(link.length).toBeLessThanOrEqual(8000);
    const back = after(...read(link));
    for (const [i, channel] of state.channels.entries()) {
      if (!channel.shown) continue;
      expect(shapesOf(back.channels[i])).toEqual(shapesOf(channel));
    }
    expect(back.channels[5].shapes).toEqual({});
  });

  it("are reported and change nothing if they can't be read", () => {
    const good = writeShapes(SHAPES);
    for (const text of [
      ...[`c0:sown_${good}0`, `c0:sown_x${good.slice(1)}`, "c0:sown", `c0:snone_${good}`],
      ...[`c0:s%ff_${good}`, `c0:sown_${good.repeat(20)}`, `c0:sown_r${"zz".repeat(7)}000000`],
      `c0:sown_${good.replace(/^t..../, "t8c5o")}`, // the upper value is below the lower one
    ]) {
      const actions = read(`#v=1&l=${text}`);
      expect(actions.map(({ type }) => type)).toEqual(["notify"]);
    }
    expect(readShapes("")).toEqual([]);
    const [shown] = after(...read("#v=1&l=c0:town")).channels;
    expect(shown.transferFunction).toBe("default"); // the user has no function of their own
  });
});

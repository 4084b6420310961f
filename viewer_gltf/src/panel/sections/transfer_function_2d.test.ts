import { describe, expect, it } from "vitest";
import { SPECIMEN_BOX, sampleManifest } from "../../../test/support/fixture/manifest";
import { MAX_SHAPES } from "../../bundle/transfer_2d";
import type { Action } from "../../state/actions";
import { initialState } from "../../state/initial_state";
import { reduce } from "../../state/reduce";
import { OWN, shapesOf } from "../../state/transfer_functions_2d";
import { makeShape } from "../../state/transfer_shapes";
import type { ChannelState, ViewerState } from "../../state/viewer_state";
import { blocksOf } from "../canvas/controls";
import {
  changePanel,
  type HistogramEditor,
  type PanelView,
  START_VIEW,
  type Wish,
} from "../controls";
import { wishOf } from "../keys";
import { spokenFeedback } from "../spoken_feedback";
import { transferFunction2dItems } from "./transfer_function_2d";

const RECTANGLE = makeShape("rectangle", { value: 0.5, gradient: 0.5 });
const TRIANGLE = makeShape("triangle", { value: 0.2, gradient: 0.5 });
const REACH = { value: 0.03, gradient: 0.05 };

/** A panel and a state that wishes change, as who has them does. */
class Desk {
  state: ViewerState = initialState(sampleManifest(3));
  view: PanelView = changePanel(START_VIEW, { panel: "histogram", channel: "c0" });

  constructor(...shapes: (typeof RECTANGLE)[]) {
    if (shapes.length > 0) {
      this.grant({ type: "set-shapes", channel: "c0", name: OWN, shapes } satisfies Action);
    }
  }

  grant(wish: Wish | null): void {
    if (wish === null || typeof wish === "string") throw new Error(`${wish}`);
    if ("panel" in wish) this.view = changePanel(this.view, wish);
    else this.state = reduce(this.state, wish);
  }

  get channel(): ChannelState {
    return this.state.channels[0];
  }

  get shapes() {
    return shapesOf(this.channel);
  }

  items() {
    return transferFunction2dItems(this.channel, this.view, null, String);
  }

  item(part: string) {
    const found = this.items().find(({ id }) => id === `c0/${part}`);
    if (found === undefined) throw new Error(`no ${part}`);
    return found;
  }

  get editor(): HistogramEditor {
    const item = this.item("shapes");
    if (item.kind !== "histogram") throw new Error(item.kind);
    return item;
  }

  click(part: string): void {
    const item = this.item(part);
    if (item.kind !== "button") throw new Error(item.kind);
    this.grant(item.to());
  }

  drag(from: readonly [number, number], to: readonly [number, number]): void {
    const at = ([value, gradient]: readonly [number, number]) => ({ value, gradient });
    this.grant(this.editor.press(at(from), REACH));
    this.grant(this.editor.drag(at(to)));
  }

  press(name: string): void {
    const { state, view } = this;
    this.grant(wishOf(name, { state, view, shown: SPECIMEN_BOX, gazed: null }));
  }
}

describe("the editor of value and gradient", () => {
  it("is in a channel's card while it is open there", () => {
    const desk = new Desk();
    const ids = () => desk.items().map(({ id }) => id.slice(3));
    expect(ids()).toEqual(["plane", "shapes", "add-rectangle", "add-triangle"]);
    desk.click("add-triangle");
    expect(ids()).toContain("shape-tip");
    expect(desk.channel.transferFunction).toBe(OWN);
    desk.grant({ panel: "histogram", channel: "c0" });
    expect(ids()).toEqual(["plane"]);
    desk.grant({ panel: "histogram", channel: "c1" });
    expect([desk.view.picked, ids()]).toEqual(["c1", ["plane"]]);
  });

  it("means the newest shape, or the one that was pressed", () => {
    const desk = new Desk(RECTANGLE);
    desk.click("add-triangle");
    expect(desk.editor.selected).toBe(1);
    desk.grant(desk.editor.press({ value: 0.5, gradient: 0.62 }, REACH)); // above the triangle
    expect(desk.editor.selected).toBe(0);
    desk.grant(desk.editor.press({ value: 0.99, gradient: 0.99 }, REACH)); // beside all
    expect(desk.editor.selected).toBe(0);
    desk.click("remove-shape");
    expect(desk.shapes.map(({ kind }) => kind)).toEqual(["triangle"]);
    desk.click("remove-shape");
    expect([desk.shapes, desk.editor.selected]).toEqual([[], null]);
  });

  it("draws a corner to where the pointer is, and a body along", () => {
    const desk = new Desk(RECTANGLE); // values 0.4..0.6, gradients 0.35..0.65
    desk.drag([0.61, 0.64], [0.81, 0.94]); // a little beside the corner: no jump
    expect(desk.shapes[0].values[1]).toBeCloseTo(0.8, 3);
    expect(desk.shapes[0].gradients[1]).toBeCloseTo(0.95, 3);
    desk.drag([0.5, 0.5], [0.3, 0.45]);
    expect(desk.shapes[0].values[0]).toBeCloseTo(0.2, 3);
    expect(desk.shapes[0].values[1]).toBeCloseTo(0.6, 3);
    expect(desk.shapes[0].gradients[0]).toBeCloseTo(0.3, 3);
  });

  it("moves nothing by a press alone, and goes back to where a drag began", () => {
    const desk = new Desk(RECTANGLE);
    const [start] = desk.shapes;
    desk.grant(desk.editor.press({ value: 0.5, gradient: 0.5 }, REACH));
    expect(desk.editor.drag({ value: 0.501, gradient: 0.5 })).toBeNull();
    desk.grant(desk.editor.drag({ value: 0.7, gradient: 0.5 }));
    desk.grant(desk.editor.drag({ value: 0.5, gradient: 0.5 }));
    expect(desk.shapes).toEqual([start]);
    desk.grant(desk.editor.press({ value: 0.05, gradient: 0.95 }, REACH));
    expect(desk.editor.drag({ value: 0.2, gradient: 0.5 })).toBeNull(); // nothing was taken
  });

  it("refuses while the bundle's shapes have not come, and beyond so many", () => {
    const full = new Desk(...Array.from({ length: MAX_SHAPES }, () => RECTANGLE));
    expect(full.item("add-rectangle").refusal).toContain(String(MAX_SHAPES));
    const desk = new Desk();
    const unknown = {
      ...desk.channel,
      transferFunctions2d: ["soft"],
      transferFunction: "soft",
    };
    const items = (channel: ChannelState) =>
      transferFunction2dItems(channel, desk.view, null, String);
    expect(items(unknown)[1].refusal).toBe("Its shapes have not come.");
    const known = { ...unknown, plane: { gradient_max: 0.5, functions: { soft: [TRIANGLE] } } };
    expect(items(known)[1]).toMatchObject({ refusal: "", shapes: [TRIANGLE] });
  });

  it("is worked by keys, which tell what they did", () => {
    const desk = new Desk();
    const before = desk.state;
    desk.press("Q");
    expect(
      spokenFeedback(
        { type: "set-shapes", channel: "c0", name: OWN, shapes: [] },
        before,
        desk.state,
        new Map(),
      ),
    ).toBe(
      "Marker 0, own: Added a rectangle: value 0.20 – 0.40, gradient 0.25 – 0.55, " +
        "opacity 50 %, softness 50 %",
    );
    desk.press("Y");
    desk.press("J"); // from the newest round to the first
    expect(desk.editor.selected).toBe(0);
    desk.press(">");
    expect(desk.shapes[0].values[0]).toBeCloseTo(0.2 + 5 / 255, 3);
    for (let i = 0; i < 7; i++) desk.press(";");
    expect(desk.view.shapeNumber).toBe("opacity");
    desk.press("<");
    expect(desk.shapes[0].opacity).toBeCloseTo(0.5 - 5 / 255, 3);
    desk.press("*");
    expect(desk.shapes[0].color).not.toEqual([1, 1, 1]);
    desk.press("Shift+Delete");
    expect(desk.shapes.map(({ kind }) => kind)).toEqual(["triangle"]);
    desk.press("H");
    expect(desk.view.isHistogramOpen).toBe(false);
  });
});

describe("its block on the panel in the room", () => {
  it("presses and drags where the ray is, up being steep", () => {
    const desk = new Desk(RECTANGLE);
    const [block] = blocksOf(desk.editor, 760);
    const [region] = block.regions;
    expect(region.isSlide).toBe(true);
    const pressed = region.press?.(0.6, 0.35); // the upper right corner
    expect(pressed).toMatchObject({ panel: "shape", grasp: { index: 0, part: "top-right" } });
    desk.grant(pressed as Wish);
    const [{ regions }] = blocksOf(desk.editor, 760);
    const wish = regions[0].to(0.9, 0.1);
    desk.grant(wish as Wish);
    expect(desk.shapes[0].values[1]).toBeCloseTo(0.9, 2);
    expect(desk.shapes[0].gradients[1]).toBeCloseTo(0.9, 2);
    expect(block.height).toBeLessThan(492); // fits a page beside the way on
  });

  it("tells why it refuses", () => {
    const desk = new Desk(RECTANGLE);
    const [{ regions }] = blocksOf({ ...desk.editor, refusal: "Not now." }, 760);
    expect(regions[0].press).toBeUndefined();
    expect(regions[0].to(0.5)).toEqual({ canvas: "announce", text: "Not now." });
  });
});

import { describe, expect, it } from "vitest";
import { SPECIMEN_BOX, sampleManifest } from "../../test/support/fixture/manifest";
import { KEYS } from "../../test/support/panel/all_keys";
import { MAX_SHAPES } from "../bundle/transfer_2d";
import { blocksOf } from "../panel/canvas/controls";
import {
  changePanel,
  type HistogramEditor,
  type PanelView,
  type Request,
  START_VIEW,
} from "../panel/controls";
import { isRefusal } from "../panel/key";
import { spokenFeedback } from "../panel/spoken_feedback";
import type { Action } from "../state/actions";
import { initialState } from "../state/initial_state";
import { reduce } from "../state/reduce";
import { OWN, shapesOf } from "../state/transfer_functions_2d";
import { makeShape } from "../state/transfer_shapes";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import { transferFunction2dItems } from "./transfer_function_2d";

const RECTANGLE = makeShape("rectangle", { value: 0.5, gradient: 0.5 });
const TRIANGLE = makeShape("triangle", { value: 0.2, gradient: 0.5 });
const REACH = { value: 0.03, gradient: 0.05 };

/** A panel and a state that requests change, like those of the panel's caller. */
class Controller {
  state: ViewerState = initialState(sampleManifest(3));
  view: PanelView = changePanel(START_VIEW, { panel: "histogram", channel: "c0" });

  constructor(...shapes: (typeof RECTANGLE)[]) {
    if (shapes.length > 0) {
      this.grant({ type: "set-shapes", channel: "c0", name: OWN, shapes } satisfies Action);
    }
  }

  grant(request: Request | null): void {
    if (request === null || typeof request === "string") throw new Error(`${request}`);
    if ("panel" in request) this.view = changePanel(this.view, request);
    else this.state = reduce(this.state, request);
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
    const request = KEYS.requestOf(name, { state, view, shown: SPECIMEN_BOX, focusTile: null });
    this.grant(request === null || isRefusal(request) ? null : request);
  }
}

describe("the editor of the joint histogram", () => {
  it("is in the card of a channel while it is open there", () => {
    const controller = new Controller();
    const ids = () => controller.items().map(({ id }) => id.slice(3));
    expect(ids()).toEqual(["plane", "shapes", "add-rectangle", "add-triangle"]);
    controller.click("add-triangle");
    expect(ids()).toContain("shape-tip");
    expect(controller.channel.transferFunction).toBe(OWN);
    controller.grant({ panel: "histogram", channel: "c0" });
    expect(ids()).toEqual(["plane"]);
    controller.grant({ panel: "histogram", channel: "c1" });
    expect([controller.view.picked, ids()]).toEqual(["c1", ["plane"]]);
  });

  it("selects the newest shape, or the one that was pressed", () => {
    const controller = new Controller(RECTANGLE);
    controller.click("add-triangle");
    expect(controller.editor.selected).toBe(1);
    // above the triangle
    controller.grant(controller.editor.press({ value: 0.5, gradient: 0.62 }, REACH));
    expect(controller.editor.selected).toBe(0);
    // outside all shapes
    controller.grant(controller.editor.press({ value: 0.99, gradient: 0.99 }, REACH));
    expect(controller.editor.selected).toBe(0);
    controller.click("remove-shape");
    expect(controller.shapes.map(({ kind }) => kind)).toEqual(["triangle"]);
    controller.click("remove-shape");
    expect([controller.shapes, controller.editor.selected]).toEqual([[], null]);
  });

  it("moves a corner with the pointer, and a whole shape", () => {
    const controller = new Controller(RECTANGLE); // values 0.4..0.6, gradients 0.35..0.65
    controller.drag([0.61, 0.64], [0.81, 0.94]); // slightly beside the corner, which must not jump
    expect(controller.shapes[0].values[1]).toBeCloseTo(0.8, 3);
    expect(controller.shapes[0].gradients[1]).toBeCloseTo(0.95, 3);
    controller.drag([0.5, 0.5], [0.3, 0.45]);
    expect(controller.shapes[0].values[0]).toBeCloseTo(0.2, 3);
    expect(controller.shapes[0].values[1]).toBeCloseTo(0.6, 3);
    expect(controller.shapes[0].gradients[0]).toBeCloseTo(0.3, 3);
  });

  it("moves nothing by a press alone, and returns exactly to the start of a drag", () => {
    const controller = new Controller(RECTANGLE);
    const [start] = controller.shapes;
    controller.grant(controller.editor.press({ value: 0.5, gradient: 0.5 }, REACH));
    expect(controller.editor.drag({ value: 0.501, gradient: 0.5 })).toBeNull();
    controller.grant(controller.editor.drag({ value: 0.7, gradient: 0.5 }));
    controller.grant(controller.editor.drag({ value: 0.5, gradient: 0.5 }));
    expect(controller.shapes).toEqual([start]);
    controller.grant(controller.editor.press({ value: 0.05, gradient: 0.95 }, REACH));
    expect(controller.editor.drag({ value: 0.2, gradient: 0.5 })).toBeNull(); // no shape was hit
  });

  it("refuses edits until the shapes of the bundle are loaded, and beyond the largest number", () => {
    const full = new Controller(...Array.from({ length: MAX_SHAPES }, () => RECTANGLE));
    expect(full.item("add-rectangle").refusal).toContain(String(MAX_SHAPES));
    const controller = new Controller();
    const unknown = {
      ...controller.channel,
      transferFunctions2d: ["soft"],
      transferFunction: "soft",
    };
    const items = (channel: ChannelState) =>
      transferFunction2dItems(channel, controller.view, null, String);
    expect(items(unknown)[1].refusal).toBe("The shapes are not loaded yet.");
    const known = {
      ...unknown,
      transfer2d: { gradient_max: 0.5, functions: { soft: [TRIANGLE] } },
    };
    expect(items(known)[1]).toMatchObject({ refusal: "", shapes: [TRIANGLE] });
  });

  it("is operated by keys, which announce their effect", () => {
    const controller = new Controller();
    const before = controller.state;
    controller.press("Q");
    expect(
      spokenFeedback(
        { type: "set-shapes", channel: "c0", name: OWN, shapes: [] },
        before,
        controller.state,
        new Map(),
      ),
    ).toBe(
      "Marker 0, own: Added a rectangle: value 0.20 – 0.40, gradient 0.25 – 0.55, " +
        "opacity 50 %, softness 50 %",
    );
    controller.press("Y");
    controller.press("J"); // from the newest shape cyclically to the first
    expect(controller.editor.selected).toBe(0);
    controller.press(">");
    expect(controller.shapes[0].values[0]).toBeCloseTo(0.2 + 5 / 255, 3);
    for (let i = 0; i < 7; i++) controller.press(";");
    expect(controller.view.shapeNumber).toBe("opacity");
    controller.press("<");
    expect(controller.shapes[0].opacity).toBeCloseTo(0.5 - 5 / 255, 3);
    controller.press("*");
    expect(controller.shapes[0].color).not.toEqual([1, 1, 1]);
    controller.press("Shift+Delete");
    expect(controller.shapes.map(({ kind }) => kind)).toEqual(["triangle"]);
    controller.press("H");
    expect(controller.view.isHistogramOpen).toBe(false);
  });
});

describe("its block on the canvas panel", () => {
  it("presses and drags at the place of the ray, with steep gradients at the top", () => {
    const controller = new Controller(RECTANGLE);
    const [block] = blocksOf(controller.editor, 760);
    const [region] = block.regions;
    expect(region.isSlide).toBe(true);
    const pressed = region.press?.(0.6, 0.35); // the upper right corner
    expect(pressed).toMatchObject({ panel: "shape", grab: { index: 0, part: "top-right" } });
    controller.grant(pressed as Request);
    const [{ regions }] = blocksOf(controller.editor, 760);
    const request = regions[0].to(0.9, 0.1);
    controller.grant(request as Request);
    expect(controller.shapes[0].values[1]).toBeCloseTo(0.9, 2);
    expect(controller.shapes[0].gradients[1]).toBeCloseTo(0.9, 2);
    expect(block.height).toBeLessThan(600); // px; the block fits on one page of the panel in stereo
  });

  it("reports why it refuses", () => {
    const controller = new Controller(RECTANGLE);
    const [{ regions }] = blocksOf({ ...controller.editor, refusal: "Not now." }, 760);
    expect(regions[0].press).toBeUndefined();
    expect(regions[0].to(0.5)).toEqual({ canvas: "announce", text: "Not now." });
  });
});

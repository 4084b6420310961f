/** The editor of the joint histogram in headless Chromium: by mouse, by finger, and in a link. */
import { expect, it } from "vitest";
import { shapesOf } from "../../src/state/transfer_functions_2d";
import { difference, type Picture, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const BALLS = "Balls";
/** Share of pixels that may differ, because some blend differently from frame to frame. */
const SAME = 0.002;
/** Space around the histogram, as a share of the canvas (see html/transfer_function_2d.ts). */
const PAD = { x: 14 / 640, y: 14 / 320 };

describeInChromium("the editor of the joint histogram", () => {
  const stand = prepareStand({ viewport: { width: 484, height: 260 }, hasTouch: true });
  const page = () => stand.viewer.page;
  const control = (part: string) => page().locator(`[data-control="${BALLS}/${part}"]`);
  const requestsOf = (name: string) =>
    stand.host.requests.filter(({ path }) => path.endsWith(`${BALLS}/${name}`)).length;
  const picture = async (): Promise<Picture> => {
    await stand.viewer.still();
    return takePicture(page());
  };
  const announced = () => page().locator("[data-announcement]").textContent();

  async function shapes() {
    const { state } = await stand.viewer.snapshot();
    const channel = state.channels.find(({ id }) => id === BALLS);
    return channel === undefined ? [] : shapesOf(channel);
  }

  /** Returns the place of a point of the histogram on the page. */
  async function at(value: number, gradient: number): Promise<{ x: number; y: number }> {
    await control("shapes").scrollIntoViewIfNeeded();
    const box = await control("shapes").boundingBox();
    if (box === null) throw new Error("no plane");
    const inside = (share: number, pad: number) => pad + share * (1 - 2 * pad);
    return {
      x: box.x + inside(value, PAD.x) * box.width,
      y: box.y + inside(1 - gradient, PAD.y) * box.height,
    };
  }

  it("shows boundaries by the bundle's shapes, which mouse and finger edit, and a link restores", async () => {
    await stand.open("&mode=all#v=1&c=Balls&depth=0");
    await stand.viewer.still();
    const flat = await picture();
    expect([requestsOf("transfer2d.json"), requestsOf("histogram2d.ktx2")]).toEqual([0, 0]);
    await stand.viewer.chooseTransferFunction(BALLS, "arcs");
    expect([requestsOf("transfer2d.json"), requestsOf("histogram2d.ktx2")]).toEqual([1, 0]);
    const boundary = await picture();
    expect(difference(flat, boundary)).toBeGreaterThan(4 * SAME);

    await stand.viewer.openCard(BALLS);
    await control("plane").check();
    await expect.poll(() => requestsOf("histogram2d.ktx2")).toBe(1);
    const [start] = await shapes();
    const [from, to] = [await at(start.values[1], 1), await at(0.6, 0.75)];
    await page().mouse.move(from.x, from.y);
    await page().mouse.down();
    await page().mouse.move(to.x, to.y, { steps: 3 });
    await page().mouse.up();
    const [drawn] = await shapes();
    expect(drawn.values[0]).toBeCloseTo(start.values[0], 2);
    expect(drawn.values[1]).toBeCloseTo(0.6, 1.5);
    expect(drawn.gradients[1]).toBeCloseTo(0.75, 1.5);
    const byMouse = await picture();
    expect(difference(boundary, byMouse)).toBeGreaterThan(SAME);

    // a finger is less exact: it hits a corner from a larger distance
    const finger = await page().context().newCDPSession(page());
    const touch = async (type: "touchStart" | "touchMove" | "touchEnd", ...to: object[]) =>
      finger.send("Input.dispatchTouchEvent", {
        type,
        touchPoints: to as { x: number; y: number }[],
      });
    const near = await at(drawn.values[0] - 0.02, drawn.gradients[1] - 0.05);
    const away = await at(drawn.values[0] + 0.18, drawn.gradients[1] + 0.15);
    await touch("touchStart", near);
    await touch("touchMove", away);
    await touch("touchEnd");
    await expect.poll(async () => (await shapes())[0].values[0]).toBeCloseTo(0.4, 1.5);
    expect((await shapes())[0].gradients[1]).toBeCloseTo(0.95, 1.5);
    const byFinger = await picture();
    expect(difference(byMouse, byFinger)).toBeGreaterThan(SAME);

    await control("add-rectangle").click();
    await control("shapes").focus();
    await page().keyboard.press("ArrowRight"); // moves the shape, and not the specimen
    const [kept, added] = await shapes();
    expect(added.values[0]).toBeCloseTo(0.4 + 2 / 255, 3);
    const address = await stand.viewer.writeLink();
    await expect.poll(announced).not.toBe("");
    await expect.poll(announced).toBe(""); // the announcement lies over the view
    const own = await picture();
    await page().goto("about:blank");
    await stand.viewer.open(address);
    expect(difference(own, await picture())).toBeLessThan(SAME);
    expect(await shapes()).toEqual([kept, added]);
    expect((await stand.viewer.snapshot()).state.notices).toEqual([]);
  });
});

/** The panel on a canvas in the scene: its content, the effect of rays on it, and when it is painted. */
import { mkdir } from "node:fs/promises";
import { expect, it } from "vitest";
import { REFUSED } from "../../src/state/refusals";
import { describeInChromium } from "../support/browser/skip";
import { type At, prepareHands } from "../support/xr/stand";

const RIGHT: At = [0.25, -0.3, -0.3];
const AWAY: At = [0, 5, -1];
/** Folder for screenshots, if they are wanted. */
const PICTURES = process.env.STEREO_PICTURES;

describeInChromium("the panel in the scene", () => {
  const hands = prepareHands(PICTURES === undefined ? undefined : { width: 1800, height: 900 });

  async function picture(name: string): Promise<void> {
    if (PICTURES === undefined) return;
    await mkdir(PICTURES, { recursive: true });
    await hands().step([0, 0]);
    await hands().page.screenshot({ path: `${PICTURES}/${name}.png` });
  }

  /** Points the right controller at a control, and presses its trigger. */
  async function choose(id: string): Promise<void> {
    await hands().point("right", RIGHT, await hands().controlAt(id));
    await hands().press("right");
  }

  /** Turns to the page that has a control, with the trigger. */
  async function reach(id: string): Promise<void> {
    for (let page = 0; page < 12; page++) {
      if ((await hands().status()).regions.includes(id)) return;
      await choose("more");
    }
    throw new Error(`no page has ${id}`);
  }

  async function gazeAt(id: string, across?: number): Promise<void> {
    await hands().lookAt(await hands().controlAt(id, across));
  }

  it("opens over the bar, below the direction of the head, also after a turn", async () => {
    await hands().gazeOnly();
    for (const [x, z] of [
      [0, -1],
      [0.6, -0.8],
      [-0.3, 0.95],
    ]) {
      await hands().lookAt([x, 0, z]);
      await hands().wait(3); // the bar follows the head
      await hands().openPanel();
      const [, up] = await hands().page.evaluate(() => window.hands.panelAt());
      expect(up).toBeCloseTo(-27.5, 1);
      await hands().lookAt([x, 0, z]);
      const [aside] = await hands().page.evaluate(() => window.hands.panelAt());
      expect(Math.abs(aside)).toBeLessThan(16); // the bar lags behind by this much
      await gazeAt("close");
      await hands().tap();
    }
  });

  it("opens by a look down, below the specimen, and closes again", async () => {
    await hands().gazeOnly();
    expect((await hands().status()).isOpen).toBe(false);
    await gazeAt("opener");
    await hands().wait(1.4);
    expect((await hands().status()).isOpen).toBe(false);
    await hands().wait(0.2);
    expect((await hands().status()).isOpen).toBe(true);
    await hands().lookAt([0, 0, -1]);
    await picture("ahead");
    // all tiles can still be gazed at
    for (const tile of ["r0_c0", "r0_c4", "r1_c0", "r1_c2", "r1_c4"]) {
      await hands().lookAt(await hands().tileAt(tile));
      expect((await hands().status()).pointed).toBe(`tile:${tile}`);
    }
    await gazeAt("close");
    await hands().tap();
    expect((await hands().status()).isOpen).toBe(false);
  });

  it("toggles what a ray points at, by gaze, tap and trigger", async () => {
    await hands().gazeOnly();
    await hands().openPanel();
    await hands().page.evaluate(() => {
      window.hands.fieldOfView_deg = 60;
    });
    await gazeAt("c1/shown");
    await hands().wait(0.75);
    await picture("dwell");
    await hands().wait(0.75);
    expect(await hands().actions()).toEqual([{ type: "show", channel: "c1", shown: false }]);
    await hands().openChannel("c0");
    await hands().reach("c0/volume");
    await hands().connect("right", true);
    await hands().point("right", RIGHT, await hands().controlAt("c0/volume"));
    expect((await hands().status()).pointed).toBe("panel:c0/volume");
    await hands().press("right");
    expect((await hands().actions()).slice(1)).toEqual([
      { type: "set", id: "volume", channel: "c0", value: false },
    ]);
    await hands().point("right", RIGHT, AWAY);
    await hands().openSection("tiles");
    await hands().tapOn("tile-map=r1_c4");
    expect((await hands().actions()).at(-1)).toEqual({ type: "select", tile: "r1_c4" });
    await picture("tiles");
  });

  it("sets a slider to the pointed place, and drags it while the trigger is held", async () => {
    await hands().connect("left", false);
    await hands().point("right", RIGHT, AWAY);
    await hands().openPanel();
    await choose("c0/open");
    await choose("c0/more");
    await reach("c0/opacity");
    await hands().point("right", RIGHT, await hands().controlAt("c0/opacity", 0.5));
    await hands().button("right", "trigger", 1);
    await hands().point("right", RIGHT, await hands().controlAt("c0/opacity", 1));
    await hands().wait(0.5);
    await hands().button("right", "trigger", 0);
    const opacities = (await hands().actions()).flatMap((action) =>
      action.type === "set" && action.id === "opacity" ? [action.value] : [],
    );
    expect(new Set(opacities)).toEqual(new Set([0.5, 1]));
    expect(opacities.length).toBeLessThan(5); // not one for each frame
    await picture("card");
    // the second of two quick presses has no effect
    while ((await hands().status()).regions.includes("up")) {
      await choose("up");
      await hands().page.waitForTimeout(450);
    }
    await reach("tab=view");
    await choose("tab=view");
    await reach("top");
    await choose("top");
    expect(await hands().page.evaluate(() => window.hands.commands)).toEqual(["top"]);
    await choose("leave");
    expect(await hands().page.evaluate(() => window.hands.leaves)).toBe(1);
  });

  it("adds shapes to the joint histogram, and drags them by their corners", async () => {
    await hands().connect("left", false);
    await hands().point("right", RIGHT, AWAY);
    await hands().openPanel();
    await choose("c0/open");
    await choose("c0/more");
    await reach("c0/plane");
    await choose("c0/plane");
    await reach("c0/add-rectangle");
    await choose("c0/add-rectangle");
    const shapes = async () => {
      const made = (await hands().actions()).flatMap((action) =>
        action.type === "set-shapes" ? [action] : [],
      );
      return made.map((action) => action.shapes[0]);
    };
    const [placed] = await shapes();
    await reach("c0/shapes");
    await picture("shapes");
    const at = (value: number, gradient: number) =>
      hands().controlAt("c0/shapes", value, 1 - gradient);
    const drag = async (
      from: readonly [number, number],
      to: readonly [number, number],
      by: "trigger" | "gaze" = "trigger",
    ) => {
      if (by === "gaze") {
        await hands().lookAt(await at(...from));
        await hands().tap(); // the first tap begins the drag
        await hands().lookAt(await at(...to));
        await hands().wait(0.2);
        await hands().tap(); // the second tap ends it
        return;
      }
      await hands().point("right", RIGHT, await at(...from));
      await hands().button("right", "trigger", 1);
      await hands().point("right", RIGHT, await at(...to));
      await hands().wait(0.2);
      await hands().button("right", "trigger", 0);
    };
    const corner = [placed.values[1], placed.gradients[1]] as const;
    await drag(corner, [0.8, 0.9]);
    const drawn = (await shapes()).at(-1);
    expect(drawn?.values[0]).toBeCloseTo(placed.values[0], 2);
    expect(drawn?.values[1]).toBeCloseTo(0.8, 2);
    expect(drawn?.gradients[1]).toBeCloseTo(0.9, 2);
    await picture("drawn");
    await hands().gazeOnly();
    await drag([0.5, 0.6], [0.6, 0.5], "gaze");
    const moved = (await shapes()).at(-1);
    expect(moved?.values[0]).toBeCloseTo(placed.values[0] + 0.1, 2);
    expect(moved?.gradients[1]).toBeCloseTo(0.8, 2);
  });

  it("reports for a while, under the gaze, why a control refuses", async () => {
    await hands().gazeOnly();
    await hands().openPanel();
    await hands().openSection("tiles");
    await hands().reach("back");
    await hands().tapOn("back");
    const why = REFUSED.back;
    const commands = await hands().page.evaluate(() => window.hands.commands);
    expect([(await hands().status()).notices, commands]).toEqual([[why], []]);
    const [aside, up] = await hands().page.evaluate(() => window.hands.noticeAt());
    expect(aside).toBeCloseTo(0);
    // notices on the lower part of the panel must not be too low for a head
    expect(up).toBeLessThan(-10);
    expect(up).toBeGreaterThan(-20.1);
    await picture("refusal");
    await hands().wait(5);
    expect((await hands().status()).notices).toEqual([why]);
    await hands().wait(1.1);
    expect((await hands().status()).notices).toEqual([]);
  });

  it("leaves a notice in the direction of the head at its appearance", async () => {
    const fault = "channels/c0/r0_c0/lod0.glb: not found (404). The other tiles go on.";
    const announce = (text: string) => hands().page.evaluate((t) => window.hands.announce(t), text);
    const noticeAt = () => hands().page.evaluate(() => window.hands.noticeAt());
    await hands().gazeOnly();
    await hands().lookAt([0, 0, -1]);
    await announce(fault);
    await picture("notice");
    await hands().lookAt([0.3, 0, -1]);
    const [aside] = await noticeAt();
    expect(aside).toBeCloseTo((-Math.atan(0.3) * 180) / Math.PI);
    await announce("Another comes where the head looks now.");
    expect((await noticeAt())[0]).toBeCloseTo(0);
    expect((await hands().status()).notices).toHaveLength(2);
    await picture("notices");
    await hands().wait(12.2);
    expect((await hands().status()).notices).toEqual([]);
  });

  it("is painted only when its content changes", async () => {
    await hands().gazeOnly();
    await hands().openPanel();
    const paints = async () => (await hands().status()).paints;
    const before = await paints();
    await hands().wait(3);
    await gazeAt("c0/shown");
    await gazeAt("c1/shown");
    await hands().wait(0.5);
    expect(await paints()).toBe(before);
    await hands().page.evaluate(() =>
      window.hands.dispatch({ type: "set", id: "quality", value: "low" }),
    );
    await hands().step([0.05]);
    await hands().page.evaluate(() =>
      window.hands.dispatch({ type: "set", id: "opacity", channel: "c0", value: 0.5 }),
    );
    await hands().step([0.05]);
    expect(await paints()).toBe(before); // the open page shows neither value
    await hands().page.evaluate(() => {
      for (const channel of ["c0", "c1"]) {
        window.hands.dispatch({ type: "show", channel, shown: false });
      }
    });
    await hands().step([0.05]);
    expect(await paints()).toBe(before + 1);
  });

  it("remains complete for the march where the specimen is cut away", async () => {
    const left = await hands().page.evaluate(() => window.leftOfTheUncut());
    expect(left).toEqual([
      [1, 0],
      [1, 0],
    ]);
  });

  it("leaves nothing on the GPU", async () => {
    const before = await hands().status();
    await hands().openPanel();
    await hands().page.evaluate(() => window.hands.dispose());
    await hands().step([0]);
    const after = await hands().status();
    expect(after.textures).toBeLessThan(before.textures + 1);
    expect(after.geometries).toBeLessThanOrEqual(before.geometries);
    expect(after.isRingShown).toBe(false);
  });
});

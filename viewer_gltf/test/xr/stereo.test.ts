/** Head and hands in stereo: what rays hit, choose and hold. */
import { expect, it } from "vitest";
import { takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { type At, prepareHands } from "../support/xr/stand";

const AWAY: At = [0, 5, -1];
const RIGHT: At = [0.25, -0.3, -0.3];
const LEFT: At = [-0.25, -0.3, -0.3];
/** As in the harness: in front of the specimen's upper edge. */
const HANDLE: At = [0, 0.45, -1.2];
const EYES_APART_M = 0.063;
const SIZE = { width: 640, height: 320 };

describeInChromium("hands in stereo", () => {
  const hands = prepareHands();

  async function idle() {
    await hands().point("left", LEFT, AWAY);
    await hands().point("right", RIGHT, AWAY);
  }

  it("point at a tile's box, and the trigger chooses the tile once", async () => {
    await idle();
    await hands().point("right", RIGHT, await hands().tileAt("r1_c3"));
    expect((await hands().status()).pointed).toBe("tile:r1_c3");
    await hands().press("right");
    const chosen = await hands().chosen();
    expect(chosen.map(({ tile }) => tile)).toEqual(["r1_c3"]);
    // the ray, in um, hits the middle of the tile's front face
    const [{ ray }] = chosen;
    const share = (8 - ray.origin[2]) / ray.direction[2];
    expect(ray.origin[0] + share * ray.direction[0]).toBeCloseTo(35, 3);
    expect(ray.origin[1] + share * ray.direction[1]).toBeCloseTo(-15, 3);
  });

  it("choose the target of the gaze if a hand points at nothing", async () => {
    await idle();
    await hands().lookAt(await hands().tileAt("r0_c1"));
    await hands().press("left");
    expect((await hands().chosen()).map(({ tile }) => tile)).toEqual(["r0_c1"]);
  });

  it("carry the specimen by exactly the hand's motion while squeezed", async () => {
    await idle();
    const before = (await hands().status()).position;
    await hands().button("right", "squeeze", 1);
    const [x, y, z] = RIGHT;
    const moves: At[] = [
      [0.02, 0.01, 0],
      [0.1, 0.05, -0.08],
      [0.17, -0.04, -0.2],
    ];
    for (const [dx, dy, dz] of moves) {
      await hands().point("right", [x + dx, y + dy, z + dz], [dx, 5 + dy, -1 + dz]);
      const { position } = await hands().status();
      [dx, dy, dz].forEach((d, i) => {
        expect(position[i] - before[i]).toBeCloseTo(d, 5);
      });
    }
    await hands().button("right", "squeeze", 0);
    const held = (await hands().status()).position;
    await hands().point("right", RIGHT, AWAY);
    expect((await hands().status()).position).toEqual(held);
    expect(await hands().chosen()).toEqual([]);
  });

  it("scale the specimen by the ratio of their distances while both squeeze", async () => {
    await idle();
    const ahead = (x: number): [At, At] => [
      [x, -0.3, -0.3],
      [x, 5, -1],
    ];
    await hands().point("left", ...ahead(-0.2));
    await hands().point("right", ...ahead(0.2));
    await hands().button("left", "squeeze", 1);
    await hands().button("right", "squeeze", 1);
    const apart = () => hands().page.evaluate(() => window.hands.apart_m);
    const before = await apart();
    for (const half of [0.3, 0.1, 0.4]) {
      await hands().point("left", ...ahead(-half));
      await hands().point("right", ...ahead(half));
      const now = await apart();
      expect(Math.abs(now - 2 * half)).toBeLessThan(0.02); // a grip is not where its ray begins
      expect((await hands().status()).scale).toBeCloseTo(now / before, 5);
    }
  });

  it("release the specimen when they disconnect", async () => {
    await idle();
    await hands().button("right", "squeeze", 1);
    await hands().connect("right", false);
    const before = (await hands().status()).position;
    await hands().point("right", [0.6, 0, -0.5], AWAY);
    await hands().connect("right", true);
    expect((await hands().status()).position).toEqual(before);
  });

  it("hold the specimen by a held trigger if there is no squeeze button", async () => {
    await hands().page.evaluate(() => window.hands.useRemote());
    await idle();
    const at = await hands().tileAt("r1_c3");
    await hands().point("right", RIGHT, at);
    const before = (await hands().status()).position;
    await hands().button("right", "trigger", 1);
    await hands().wait(0.5);
    const [x, y, z] = RIGHT;
    await hands().point("right", [x + 0.1, y, z], [at[0] + 0.1, at[1], at[2]]);
    const held = (await hands().status()).position;
    expect(held[0] - before[0]).toBeCloseTo(0.1, 5);
    await hands().button("right", "trigger", 0);
    await idle();
    expect((await hands().status()).position).toEqual(held);
  });

  it("drag a handle while the trigger is held", async () => {
    await idle();
    await hands().point("right", RIGHT, HANDLE);
    expect((await hands().status()).pointed).toBe("handle");
    await hands().button("right", "trigger", 1);
    await hands().point("right", RIGHT, [0.3, 0.3, -1]);
    const { drags } = await hands().status();
    expect(drags).toBeGreaterThan(0);
    await hands().button("right", "trigger", 0);
    const after = (await hands().status()).drags;
    await hands().point("right", RIGHT, AWAY);
    expect((await hands().status()).drags).toBe(after);
    expect(await hands().chosen()).toEqual([]);
  });

  it("zoom with the stick about the tile that is pointed at", async () => {
    await idle();
    const at = await hands().tileAt("r0_c4");
    await hands().point("right", RIGHT, at);
    await hands().page.evaluate(() => window.hands.stick("right", 0, -1));
    await hands().wait(0.5);
    await hands().page.evaluate(() => window.hands.stick("right", 0, 0));
    const { scale } = await hands().status();
    expect(scale).toBeCloseTo(2.5 ** 0.5, 2);
    const after = await hands().tileAt("r0_c4");
    expect(Math.hypot(...after.map((v, i) => v - at[i]))).toBeLessThan(1e-3);
  });
});

describeInChromium("the gaze in stereo", () => {
  const hands = prepareHands(undefined, 1);

  it("chooses once, at 1.5 s and not at 1.4 s, and fills its ring", async () => {
    await hands().gazeOnly();
    await hands().lookAt(await hands().tileAt("r0_c2"));
    expect((await hands().status()).pointed).toBe("tile:r0_c2");
    await hands().wait(0.4);
    expect((await hands().status()).progress).toBe(0); // a passing gaze shows no ring
    await hands().wait(0.55);
    expect((await hands().status()).progress).toBeCloseTo(0.5, 6);
    expect((await hands().status()).isRingShown).toBe(true);
    await hands().wait(0.45);
    expect(await hands().chosen()).toEqual([]);
    await hands().wait(0.1);
    expect((await hands().chosen()).map(({ tile }) => tile)).toEqual(["r0_c2"]);
    await hands().wait(3);
    expect(await hands().chosen()).toHaveLength(1);
  });

  it("starts again after it has left", async () => {
    await hands().gazeOnly();
    const at = await hands().tileAt("r0_c2");
    await hands().lookAt(at);
    await hands().wait(1.4);
    await hands().lookAt(AWAY);
    expect((await hands().status()).isRingShown).toBe(false);
    await hands().lookAt(at);
    await hands().wait(1.4);
    expect(await hands().chosen()).toEqual([]);
    await hands().wait(0.1);
    expect(await hands().chosen()).toHaveLength(1);
  });

  it("chooses nothing with dwell off, but the button chooses at once", async () => {
    await hands().gazeOnly();
    await hands().page.evaluate(() =>
      window.hands.dispatch({ type: "set", id: "dwell", value: false }),
    );
    await hands().lookAt(await hands().tileAt("r1_c0"));
    await hands().wait(4);
    expect(await hands().chosen()).toEqual([]);
    await hands().tap();
    expect((await hands().chosen()).map(({ tile }) => tile)).toEqual(["r1_c0"]);
  });

  it("picks up a handle, carries it, and puts it down where it rests", async () => {
    await hands().gazeOnly();
    await hands().lookAt(HANDLE);
    await hands().wait(1.5);
    expect((await hands().status()).drags).toBeGreaterThan(0);
    const tile = await hands().tileAt("r1_c3"); // not chosen, because the handle is carried past it
    await hands().lookAt(tile);
    const [x, y, z] = await hands().page.evaluate(() => window.hands.drags.at(-1) ?? [0, 0, 0]);
    expect(Math.hypot(x / z - tile[0] / tile[2], y / z - tile[1] / tile[2])).toBeLessThan(1e-4);
    await hands().wait(1.6);
    const { drags } = await hands().status();
    await hands().wait(0.5);
    expect((await hands().status()).drags).toBe(drags);
    expect(await hands().chosen()).toEqual([]);
  });

  it("shows its ring at the distance of the tile, for both eyes", async () => {
    await hands().gazeOnly();
    const fov_deg = 30;
    await hands().page.evaluate((degrees) => {
      window.hands.fieldOfView_deg = degrees;
    }, fov_deg);
    const at = await hands().tileAt("r0_c2");
    await hands().lookAt(at);
    await hands().wait(1.45);
    await hands().step([0, 0]);
    const picture = await takePicture(hands().page, { x: 0, y: 0, ...SIZE });
    const white = picture.where((pixel) => Math.min(...pixel) > 150);
    const centre = (eye: 0 | 1) => {
      const half = SIZE.width / 2;
      const xs = white.map(([x]) => x - eye * half).filter((x) => x >= 0 && x < half);
      expect(xs.length).toBeGreaterThan(50);
      return xs.reduce((sum, x) => sum + x, 0) / xs.length;
    };
    const px_per_tangent = SIZE.height / 2 / Math.tan((fov_deg * Math.PI) / 360);
    const expected = (px_per_tangent * EYES_APART_M) / Math.hypot(...at);
    expect(Math.abs(centre(0) - centre(1) - expected)).toBeLessThan(1);
    // the gaze starts between the eyes, so the ring is equally far from the middle in both images
    expect(Math.abs(centre(0) + centre(1) + 1 - SIZE.width / 2)).toBeLessThan(1);
  });

  it("waits while a hand points at a target", async () => {
    await hands().lookAt(await hands().tileAt("r0_c2"));
    await hands().point("left", LEFT, AWAY);
    await hands().point("right", RIGHT, await hands().tileAt("r1_c3"));
    await hands().wait(3);
    expect(await hands().chosen()).toEqual([]);
    await hands().point("right", RIGHT, AWAY);
    await hands().wait(1.5);
    expect((await hands().chosen()).map(({ tile }) => tile)).toEqual(["r0_c2"]);
  });
});

describeInChromium("the page of moves in the panel", () => {
  const hands = prepareHands();
  const away = async () => Math.hypot(...(await hands().status()).position);

  async function openMoves(): Promise<void> {
    await hands().openPanel();
    await hands().wait(0.1);
    await hands().openSection("move");
    await hands().wait(0.1);
  }

  it("brings the specimen nearer while the gaze stays, and stops when it leaves", async () => {
    await hands().gazeOnly();
    await openMoves();
    const before = await away();
    await hands().lookAt(await hands().controlAt("nearer"));
    await hands().wait(1.4);
    expect(await away()).toBe(before);
    await hands().wait(0.1);
    const stepped = await away();
    expect(stepped).toBeLessThan(before); // one step at once, so that a short look makes one step
    await hands().wait(0.25);
    expect(await away()).toBe(stepped);
    await hands().wait(2);
    const near = await away();
    expect(near).toBeLessThan(0.5 * stepped);
    expect((await hands().status()).scale).toBe(1); // nearer, not larger, so that volumes are shown
    await hands().lookAt(AWAY);
    await hands().wait(1);
    expect(await away()).toBe(near);
  });

  it("takes a tap as one step, and a held trigger as many", async () => {
    await hands().gazeOnly();
    await openMoves();
    await hands().reach("shift-right");
    const at = await hands().controlAt("shift-right");
    await hands().lookAt(at);
    const x = async () => (await hands().status()).position[0];
    const before = await x();
    await hands().tap();
    await hands().wait(1);
    expect(await x()).toBeCloseTo(before + 0.1, 6);
    await hands().lookAt(AWAY);
    await hands().connect("right", true);
    await hands().point("right", RIGHT, at);
    await hands().button("right", "trigger", 1);
    await hands().wait(1.35);
    const held = await x();
    expect(held).toBeGreaterThan(before + 0.3);
    await hands().button("right", "trigger", 0);
    await hands().wait(1);
    expect(await x()).toBe(held);
  });
});

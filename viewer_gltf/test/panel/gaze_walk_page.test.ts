/** All of the panel by gaze alone in the page itself: a split screen, and a phone's reports of its turn. */
import { expect, it } from "vitest";
import { addClock, holdFrames } from "../support/browser/clock";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand, type Stand } from "../support/browser/stand";
import { CHANNEL, labelOf, prepareObjects } from "../support/object_bundle";
import { hasPython } from "../support/python";

const SMALL = { viewport: { width: 96, height: 48 }, isBlind: true };

/** Open the panel by gaze, try out each control of each page, or of one tab's, close it, and leave stereo. */
async function walk(stand: Stand, only = "") {
  const { page } = stand.viewer;
  await page.keyboard.press("P");
  await expect.poll(async () => (await stand.viewer.snapshot()).isStereo).toBe(true);
  await holdFrames(page);
  return page.evaluate(async (only) => {
    const { stereocell: api, frameClock: clock } = window;
    if (api === undefined || clock === undefined) throw new Error("no viewer, or no clock");
    const DWELL_S = 1.5;
    /** The head rests there by the second report: where it will be is told from the last two. */
    const turn = (alpha: number, beta: number) => {
      for (let k = 0; k < 2; k++) {
        dispatchEvent(new DeviceOrientationEvent("deviceorientation", { alpha, beta, gamma: 0 }));
      }
    };
    const pass = (seconds: number) => {
      for (let t = 0; t < seconds; t += 0.1) clock.run(clock.now_ms + 100);
    };
    const menu = () => api.snapshot().menu;
    const ids = () => menu().map(({ id }) => id);
    let [alpha, beta] = [0, 90];
    /** The phone turns until it looks there; the eyes lie before the neck, and move on the way. */
    const lookAt = (id: string) => {
      for (let k = 0; k < 2; k++) {
        const entry = menu().find((each) => each.id === id);
        if (entry === undefined) throw new Error(`no ${id} among ${ids()}`);
        [alpha, beta] = [alpha - entry.right_deg, 90 + entry.up_deg];
        turn(alpha, beta);
        pass(0.1);
      }
    };
    const lookAway = () => {
      turn(alpha, 150);
      pass(0.1);
    };
    /** What there is to be seen of an answer. */
    const seen = () => {
      const { state, told, specimenAt, specimenTurn, isStereo } = api.snapshot();
      const onPage = [...document.querySelectorAll("input")].map((each) => each.checked);
      // the label of the control that leads to the next page counts the pages: More (1 of 2)
      const labels = menu().map(({ id, label }) => [id, label]);
      return JSON.stringify([state, told, specimenAt, specimenTurn, isStereo, labels, onPage]);
    };
    const gaze = (id: string) => {
      lookAt(id);
      pass(DWELL_S);
      const after = seen();
      lookAway();
      return after;
    };
    const walked: string[] = [];
    const silent: string[] = [];
    turn(0, 90);
    pass(0.2);
    const before = ids();
    gaze("opener");
    for (const tab of ids().filter((id) => id.startsWith(`tab=${only}`))) {
      gaze(tab);
      const ofTab = new Set(["leave", "close", "more", "opener"]);
      const isNew = (id: string) => !id.startsWith("tab=") && !ofTab.has(id);
      let stale = 0;
      for (let pages = 0; pages < 40; pages++) {
        const again: string[] = [];
        const tryOut = (id: string) => {
          const before = seen();
          return gaze(id) !== before;
        };
        // what is chosen may bring others, or take some away
        for (let id = ids().find(isNew); id !== undefined; id = ids().find(isNew)) {
          ofTab.add(id);
          if (!tryOut(id)) again.push(id);
          walked.push(id);
          await new Promise((resolve) => setTimeout(resolve)); // what loads may come
        }
        // what was chosen already, or told for another control, comes after another
        for (const id of again) {
          const next = walked[walked.lastIndexOf(id) + 1];
          if (ids().includes(next)) gaze(next);
          pass(6); // what was told has gone
          if (ids().includes(id) && !tryOut(id)) silent.push(`${tab} ${id}`);
        }
        if (!ids().includes("more")) break;
        gaze("more");
        // what is chosen may move others to an earlier page: once round again
        stale = ids().some(isNew) ? 0 : stale + 1;
        if (stale > 10) break;
      }
    }
    gaze("close");
    const closed = ids();
    gaze("opener");
    gaze("leave");
    return { before, walked, silent, closed, isStereo: api.snapshot().isStereo };
  }, only);
}

describeInChromium("in a Cardboard, by gaze alone", () => {
  const stand = prepareStand(SMALL);

  it("the panel is opened, each control of each page acts, and stereo is left", async () => {
    await addClock(stand.viewer.page);
    await stand.open("&mode=off#v=1&gaze=on");
    const found = await walk(stand);
    expect(found.silent).toEqual([]);
    expect(found.walked.length).toBeGreaterThan(150);
    for (const id of [
      ...["Balls/color", "mode=disc", "switch-distance", "trace", "isolate", "reset", "nearer"],
      ...["lenses=before", "stereo-strength", "tool=measure", "clip-box", "slice-x", "quality=low"],
    ]) {
      expect(found.walked).toContain(id);
    }
    expect([found.before, found.closed]).toEqual([["opener"], ["opener"]]);
    expect(found.isStereo).toBe(false);
  });
});

describeInChromium("in a Cardboard, the objects of a label map", () => {
  if (!hasPython) {
    it.skip("needs Python");
    return;
  }
  const stand = prepareStand({ ...SMALL, bundle: prepareObjects("--organs") });

  it("are coloured, left out, found, hidden and selected by gaze, of 117 kinds, too", async () => {
    await addClock(stand.viewer.page);
    const linked = JSON.stringify({ picked: String(labelOf(7)), ranges: { CD8: [null, 1000] } });
    await stand.open(`#v=1&gaze=on&objects=${CHANNEL}:${encodeURIComponent(linked)}`);
    await stand.viewer.settled();
    const found = await walk(stand, "objects");
    expect(found.silent).toEqual([]);
    const of = (part: string) => `${CHANNEL}/objects-${part}`;
    for (const part of [
      ...["color-by", "filter-by", "column-cell_type", "legend-next-cell_type", "column-CD8"],
      ...["fly", "hide", "only-next", "select", "select-shown", "only-selected", "all", "gap"],
      "scatter",
    ]) {
      expect(
        found.walked.some((id) => id.startsWith(of(part))),
        part,
      ).toBe(true);
    }
  });
});

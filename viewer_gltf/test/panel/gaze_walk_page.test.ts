/**
 * A walk through the whole panel by gaze alone in the page itself: a split screen, and a phone's
 * reports of its rotation.
 */
import { expect, it } from "vitest";
import { addClock, holdFrames } from "../support/browser/clock";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand, type Stand } from "../support/browser/stand";
import { CHANNEL, labelOf, prepareObjects } from "../support/object_bundle";
import { hasPython } from "../support/python";

const SMALL = { viewport: { width: 96, height: 48 }, isBlind: true };

/**
 * Opens the panel by gaze, tries each control of each page, or of one section's pages, closes it,
 * and ends stereo.
 */
async function walk(stand: Stand, only = "") {
  const { page } = stand.viewer;
  await page.keyboard.press("P");
  await expect.poll(async () => (await stand.viewer.snapshot()).isStereo).toBe(true);
  await holdFrames(page);
  return page.evaluate(async (only) => {
    const { stereocell: api, frameClock: clock } = window;
    if (api === undefined || clock === undefined) throw new Error("no viewer, or no clock");
    const DWELL_S = 1.5;
    const UNDO = "undo-choice";
    /** Two reports bring the head to rest, because its motion is predicted from the last two. */
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
    /** Turns the phone towards a control. The eyes are in front of the neck, and move on the way. */
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
    /** All visible effects of a response. *Undo* disappears by itself, so it does not count. */
    const seen = () => {
      const { state, stereoNotices, specimenAt, specimenTurn, isStereo } = api.snapshot();
      const onPage = [...document.querySelectorAll("input")].map((each) => each.checked);
      const labels = menu().flatMap(({ id, label }) => (id === UNDO ? [] : [[id, label]]));
      return JSON.stringify([
        state,
        stereoNotices,
        specimenAt,
        specimenTurn,
        isStereo,
        labels,
        onPage,
      ]);
    };
    const gaze = (id: string) => {
      lookAt(id);
      pass(DWELL_S);
      const after = seen();
      lookAway();
      return after;
    };
    const tryOut = (id: string) => {
      const before = seen();
      return gaze(id) !== before;
    };
    const walked: string[] = [];
    const silent: string[] = [];
    const ofBar = new Set([UNDO, "up", "more", "leave", "close", "opener"]);
    const ofPage = () => ids().filter((id) => !ofBar.has(id) && !id.startsWith("tab="));

    /** Tries each control of each page of a section, of a group, or of the bar of the closed panel. */
    const walkPages = async (name: string) => {
      const done = new Set<string>();
      const pages = new Set<string>();
      const next = () => ofPage().find((id) => !done.has(id));
      // a choice may move controls to an earlier page, so all pages are visited again
      for (let stale = 0; stale <= pages.size; stale = next() === undefined ? stale + 1 : 0) {
        pages.add(ofPage().join());
        const again: string[] = [];
        // a choice may add or remove controls
        for (let id = next(); id !== undefined; id = next()) {
          done.add(id);
          if (id.endsWith("/open")) await walkGroup(name, id);
          else if (!tryOut(id)) again.push(id);
          walked.push(id);
          // one turn of the event loop, in which code that a control needs may begin to load
          await new Promise((resolve) => setTimeout(resolve));
        }
        // a control without a response is tried again after another one, because its value or
        // notice may have been there before
        for (const id of again) {
          // code that is loaded on demand is loaded by then
          await new Promise((resolve) => setTimeout(resolve, 500));
          const following = walked[walked.lastIndexOf(id) + 1];
          if (ids().includes(following)) gaze(following);
          pass(6); // the notice has gone
          if (ids().includes(id) && !tryOut(id)) silent.push(`${name} ${id}`);
        }
        pass(3); // the specimen is no longer carried by the gaze
        if (!ids().includes("more")) break;
        gaze("more");
      }
    };
    /**
     * Tries the colours that a glance at a swatch shows over the name, and the page of the channel
     * or lamp.
     */
    const walkGroup = async (name: string, swatch: string) => {
      const group = swatch.slice(0, -"/open".length);
      const look = () => {
        lookAt(swatch);
        pass(0.6);
      };
      look();
      const colours = ids().filter((id) => id.startsWith(`${group}/color=`));
      const answered = new Set<string>();
      // the first colour is tried again, because a channel may have had it
      for (const id of [...colours, ...colours.slice(0, 1)]) {
        look();
        if (!ids().includes(id)) continue;
        if (tryOut(id)) answered.add(id);
        walked.push(id);
        pass(0.6); // the colours have gone
      }
      silent.push(...colours.filter((id) => !answered.has(id)).map((id) => `${name} ${id}`));
      look();
      const more = `${group}/more`;
      if (ids().includes(more)) lookAt(more);
      pass(DWELL_S);
      lookAway();
      await walkPages(`${name} ${group}`);
      gaze("up");
    };
    const toList = () => {
      while (ids().includes("up")) gaze("up");
    };
    const sections = () => {
      toList();
      const found = new Set<string>();
      for (let before = -1; found.size > before; ) {
        before = found.size;
        for (const id of ids().filter((each) => each.startsWith("tab="))) found.add(id);
        if (ids().includes("more")) gaze("more");
      }
      return [...found];
    };

    turn(0, 90);
    pass(0.1);
    // the head has come to rest, which defines straight ahead
    await new Promise((resolve) => setTimeout(resolve, 600));
    pass(0.1);
    const before = ids();
    if (only === "") await walkPages("bar");
    gaze("opener");
    for (const tab of sections().filter((id) => id.startsWith(`tab=${only}`))) {
      toList();
      while (!ids().includes(tab)) gaze("more");
      gaze(tab);
      await walkPages(tab);
    }
    gaze("close");
    pass(6); // nothing can be undone any more
    const closed = ids();
    gaze("opener");
    gaze("leave");
    return { before, walked, silent, closed, isStereo: api.snapshot().isStereo };
  }, only);
}

/** Buttons of the bar while the panel is closed. */
const BAR = ["nearer", "farther", "roll-left", "roll-right", "move"]
  .map((id) => `bar-${id}`)
  .concat("opener");

describeInChromium("in a Cardboard, by gaze alone", () => {
  const stand = prepareStand(SMALL);

  it("the panel is opened, each control of each page responds, and stereo is ended", async () => {
    await addClock(stand.viewer.page);
    await stand.open("&mode=off#v=1&gaze=on");
    const found = await walk(stand);
    expect(found.silent).toEqual([]);
    expect(found.walked.length).toBeGreaterThan(150);
    for (const id of [
      ...[
        "Balls/shown",
        "Balls/volume",
        "mode=disc",
        "switch-distance",
        "trace",
        "isolate",
        "reset",
        "nearer",
      ],
      ...["lenses=v1", "stereo-strength", "tool=measure", "clip-box", "slice-x", "quality=low"],
    ]) {
      expect(found.walked).toContain(id);
    }
    expect(found.before).toEqual(expect.arrayContaining(BAR));
    expect(found.closed).toEqual(expect.arrayContaining(BAR));
    expect(found.walked).toEqual(expect.arrayContaining(BAR.filter((id) => id !== "opener")));
    expect(found.isStereo).toBe(false);
  });
});

describeInChromium("in a Cardboard, the objects of a label map", () => {
  if (!hasPython) {
    it.skip("needs Python");
    return;
  }
  const stand = prepareStand({ ...SMALL, bundle: prepareObjects("--organs") });

  it("are coloured, filtered, found, hidden and selected by gaze, also with 117 kinds", async () => {
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

/**
 * Careless use of the page: rests, double clicks, rotations of the phone during loading, sliders
 * during motion, gazes in the split screen. No act changes more than it may, no act fails, and
 * nothing leaks.
 *
 * STEREOCELL_CARELESS_S      duration of the careless use, s; default 8, ten minutes in `make
 * careless`
 * STEREOCELL_CARELESS_SEED   seed of another user
 * STEREOCELL_CARELESS_REPORT file for the figures
 */
import { writeFile } from "node:fs/promises";
import { expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { DEMO_BUNDLE, prepareStand } from "../support/browser/stand";
import { ACTS, enterStereo, IN_STEREO, leaveStereo } from "../support/careless/acts";
import { Figured, type Figures } from "../support/careless/figures";
import {
  type Act,
  changesBetween,
  chooseAct,
  comeToRest,
  type Reader,
  unexpected,
} from "../support/careless/walk";
import { IS_EXHAUSTIVE } from "../support/exhaustive";
import { seeded } from "../support/seeded";

const WALK_S = Number(process.env.STEREOCELL_CARELESS_S ?? 8);
const SEED = Number(process.env.STEREOCELL_CARELESS_SEED ?? 1);
const REPORT = process.env.STEREOCELL_CARELESS_REPORT;
const IS_LONG = process.env.STEREOCELL_CARELESS_S !== undefined;
/** Number of acts between two visits to the split screen, and in the split screen. */
const ACTS_ON_SCREEN = 12;
const ACTS_IN_STEREO = 3;

const ROUNDS = IS_EXHAUSTIVE ? 200 : 6;
/** Rounds after which every part is loaded, and the history of undo is full. */
const WARM_ROUNDS = IS_EXHAUSTIVE ? 20 : 3;
/**
 * Objects of each kind that may appear after the first rounds. On a busy machine, a part of the
 * view is loaded in a later round. A leak adds an object in each round, or in each of a few.
 */
const LATE_OBJECTS = Math.max(2, Math.floor((ROUNDS - WARM_ROUNDS) / 10));
/** Bytes by which the JavaScript heap may grow: steps that can be undone, and compiled code. */
const HEAP_SLACK_BYTES = 3 * 1024 * 1024;
const PATIENT = { timeout: 30_000, interval: 1000 };

/** Returns the figures that have grown by more than their bounds, each with both values. */
function growth(before: Figures, after: Figures): readonly string[] {
  const names = Object.keys(before) as (keyof Figures)[];
  return names.flatMap((name) => {
    const slack = name === "heap_bytes" ? HEAP_SLACK_BYTES : LATE_OBJECTS;
    const hasGrown = after[name] > before[name] + slack;
    return hasGrown ? [`${name}: ${before[name]} before, ${after[name]} after`] : [];
  });
}

/** Words in notices of faults, which a careless user must not cause. */
const FAULT = /failed|expected|can't|damaged|broke|answered|dropped/;

describeInChromium("careless use", () => {
  const stand = prepareStand({
    bundle: DEMO_BUNDLE,
    viewport: { width: 640, height: 480 },
    isBlind: !IS_LONG,
  });
  /** Faults of the page, and changes that no act may make. */
  const faults: string[] = [];

  function listenForFaults(): void {
    const { page } = stand.viewer;
    faults.splice(0);
    page.on("pageerror", (error) => faults.push(`page: ${error.message}`));
    page.on("console", (message) => {
      if (message.type() === "error") faults.push(`console: ${message.text()}`);
    });
  }

  /** Acts once, at random, and compares the changes with those that the act may make. */
  async function act(reader: Reader, acts: readonly Act[], done: string[]): Promise<void> {
    const before = await comeToRest(reader);
    const one = chooseAct(reader.random, acts);
    done.push(one.name);
    const detail = await one.run(reader);
    const after = await comeToRest(reader);
    const changed = unexpected(one, changesBetween(before, after));
    const control = typeof detail === "string" ? ` (${detail})` : "";
    const which = `act ${done.length}, ${one.name}${control}`;
    if (changed.length > 0) faults.push(`${which}: changed ${changed.join(", ")}`);
    const fresh = after.state.notices.filter((text) => !before.state.notices.includes(text));
    faults.push(...fresh.filter((text) => FAULT.test(text)).map((text) => `${which}: ${text}`));
  }

  /** `points` is the number of points that the user has measured. Each has a mark and a label. */
  type Sample = Figures & { at_s: number; acts: number; points: number };

  async function countPoints({ viewer }: Reader): Promise<number> {
    const { measured, measurements } = (await viewer.snapshot()).state;
    return measurements.reduce((sum, { points }) => sum + points.length, measured.length);
  }

  /** Removes all measurements, because their marks are not a leak. */
  async function clearMeasurements(reader: Reader): Promise<void> {
    await reader.page.evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    while ((await countPoints(reader)) > 0) await reader.page.keyboard.press("u");
  }

  async function walk(reader: Reader, done: string[], figures: Sample[]): Promise<void> {
    const figured = await Figured.of(reader.page);
    const start_ms = Date.now();
    const passed_s = () => (Date.now() - start_ms) / 1000;
    const figure = async () => {
      const [at_s, points] = [Math.round(passed_s()), await countPoints(reader)];
      figures.push({ at_s, acts: done.length, points, ...(await figured.now()) });
    };
    while (passed_s() < WALK_S) {
      for (let i = 0; i < ACTS_ON_SCREEN && passed_s() < WALK_S; i++) await act(reader, ACTS, done);
      await enterStereo(reader);
      for (let i = 0; i < ACTS_IN_STEREO; i++) await act(reader, IN_STEREO, done);
      await leaveStereo(reader);
      await figure();
    }
    await clearMeasurements(reader);
    await figure();
  }

  it(`changes only what each act may change in ${WALK_S} s`, {
    timeout: 1000 * (WALK_S + 180),
  }, async () => {
    await stand.open("&quality=auto");
    listenForFaults();
    const { viewer } = stand;
    const done: string[] = [];
    const figures: Sample[] = [];
    try {
      await walk({ viewer, page: viewer.page, random: seeded(SEED) }, done, figures);
    } finally {
      const report = JSON.stringify({ seed: SEED, done, figures, faults }, null, 1);
      if (REPORT) await writeFile(REPORT, report);
    }
    expect(faults).toEqual([]);
    expect(done.length).toBeGreaterThan(3);
    if (figures.length < 9) return;
    // In the first third, parts of the page and shaders are loaded, and stay. The content of the
    // page varies with time, but a leak would also show in the smallest figures.
    const third = Math.floor(figures.length / 3);
    const [middle, last] = [figures.slice(third, -third), figures.slice(-third)];
    for (const name of [
      "listeners",
      "nodes",
      "heap_bytes",
      "textures",
      "geometries",
      "programs",
    ] as const) {
      const most = Math.max(...middle.map((each) => each[name]));
      const least = Math.min(...last.map((each) => each[name]));
      expect(least, name).toBeLessThanOrEqual(most * 1.05);
    }
  });

  it(`leaks nothing in ${ROUNDS} rounds of all actions`, {
    timeout: IS_EXHAUSTIVE ? 3_600_000 : 180_000,
  }, async () => {
    const { viewer } = stand;
    const { page } = viewer;
    await stand.open("&mode=off");
    listenForFaults();
    const figured = await Figured.of(page);
    const reader: Reader = { viewer, page, random: seeded(SEED) };
    const [{ id: channel }] = stand.manifest.channels;
    const press = async (...keys: readonly string[]) => {
      for (const key of keys) await page.keyboard.press(key);
    };
    /** @param isFirst waits in each mode until everything is loaded, so that nothing is loaded later */
    const round = async (isFirst: boolean) => {
      for (const mode of ["disc", "tile", "all", "traced", "off"]) {
        await page.locator("select[data-mode]").selectOption(mode);
        if (isFirst) await viewer.settled();
      }
      await press("1", "1", "c", "W", "w", "t", "t", "Escape", "i", "Escape");
      await press("b", "b", "n", "n", "\\", "|", "\\", "|", "p", "Enter", "Enter", "u", "p");
      await press("ArrowRight", "z", "Control+z", "Control+y", "l");
      for (let i = 0; i < 2; i++) {
        await page.locator(`[data-channel="${channel}"] [data-opener]`).click();
        for (const section of ["view", "light"]) {
          await page.locator(`h2 [data-opener="${section}"]`).click();
        }
      }
      await press("?", "Escape", ":");
      await page.locator("dialog[open]").waitFor();
      await press("Escape");
      await page.setViewportSize({ width: 480, height: 640 });
      await page.setViewportSize({ width: 640, height: 480 });
      await enterStereo(reader);
      await leaveStereo(reader);
      await press("r");
      await viewer.settled();
    };
    for (let i = 0; i < WARM_ROUNDS; i++) await round(true);
    const before = await figured.now();
    const shown = (await viewer.snapshot()).state;
    for (let i = WARM_ROUNDS; i < ROUNDS; i++) await round(false);
    let after = await figured.now();
    // On a busy machine the page releases some objects only some time after the last act.
    await expect
      .poll(async () => {
        after = await figured.now();
        return growth(before, after);
      }, PATIENT)
      .toEqual([]);
    process.stdout.write(
      `${ROUNDS} rounds: ${JSON.stringify(before)} to ${JSON.stringify(after)}\n`,
    );
    const { state } = await viewer.snapshot();
    expect(
      changesBetween(
        { state: shown, look: { position: [0, 0, 0], target: [0, 0, 0] } },
        { state, look: { position: [0, 0, 0], target: [0, 0, 0] } },
      ),
    ).toEqual([]);
    // A leak of listeners is detected, even if the page has released some others by now.
    await page.evaluate(() => {
      for (let i = 0; i < 200; i++) addEventListener("leak", () => undefined);
    });
    await expect
      .poll(async () => growth(after, await figured.now()), PATIENT)
      .toEqual([expect.stringMatching(/^listeners: /)]);
    expect(faults).toEqual([]);
  });
});

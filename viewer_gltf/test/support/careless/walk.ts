/**
 * A careless user: acts at random, reproducibly by a seed, and compares the changes of each act
 * with those that it may make.
 */
import type { Page } from "playwright-core";
import type { Snapshot } from "../../../src/host/snapshot";
import type { ViewerPage } from "../browser/page";

/** Parts of the state that an act may change; "look": the camera; "any": anything that a control sets. */
export type Change = keyof Snapshot["state"] | "look" | "any";

export type Reader = Readonly<{
  viewer: ViewerPage;
  page: Page;
  /** Returns the next random number of the seed, 0..1. */
  random: () => number;
}>;

export type Act = Readonly<{
  name: string;
  changes: readonly Change[];
  /** Relative frequency of the act. */
  weight: number;
  /** @returns name of the operated control, if any */
  run: (reader: Reader) => Promise<unknown>;
}>;

/** Largest difference between two coordinates that count as equal, m: the rest of a glide. */
const SAME_M = 1e-3;
/** Parts that change without an act: loaded data and faults. */
const PASSIVE: ReadonlySet<string> = new Set(["notices", "retryable"]);

type View = Readonly<{ state: Snapshot["state"]; look: Snapshot["look"] }>;

function channelsOf({ channels }: Snapshot["state"]): string {
  return JSON.stringify(channels.map(({ turn, transfer2d, ...channel }) => channel));
}

/** Returns the names of everything that differs. */
export function changesBetween(before: View, after: View): readonly string[] {
  const keys = Object.keys(before.state) as (keyof Snapshot["state"])[];
  const changed: string[] = keys.filter((key) => {
    if (PASSIVE.has(key)) return false;
    if (key === "channels") return channelsOf(before.state) !== channelsOf(after.state);
    return JSON.stringify(before.state[key]) !== JSON.stringify(after.state[key]);
  });
  const [was, is] = [before.look, after.look].map((look) => [...look.position, ...look.target]);
  if (was.some((v, i) => Math.abs(v - is[i]) > SAME_M)) changed.push("look");
  return changed;
}

export function unexpected({ changes }: Act, changed: readonly string[]): readonly string[] {
  const isExpected = (name: string) =>
    changes.includes(name as Change) || (changes.includes("any") && name !== "look");
  return changed.filter((name) => !isExpected(name));
}

/** Waits until a glide or a flight has ended. */
export async function comeToRest({ page, viewer }: Reader): Promise<View> {
  let before = await viewer.snapshot();
  for (let i = 0; i < 60; i++) {
    await page.waitForTimeout(150);
    const after = await viewer.snapshot();
    const isSame = changesBetween(before, after).length === 0;
    before = after;
    if (isSame) break;
  }
  return before;
}

export function choose<T>(random: () => number, list: readonly T[]): T {
  return list[Math.floor(random() * list.length)];
}

export function chooseAct(random: () => number, acts: readonly Act[]): Act {
  let left = random() * acts.reduce((sum, { weight }) => sum + weight, 0);
  for (const act of acts) {
    left -= act.weight;
    if (left < 0) return act;
  }
  return acts[acts.length - 1];
}

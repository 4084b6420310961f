/**
 * Settings and actions that parts of the viewer add to the state. The host adds those of all its parts before it makes
 * the first state, so that a viewer without a part has none of them.
 */
import type { PartAction, PartActions } from "./actions";
import type { Parameter } from "./parameters/kinds";
import type { SettingsOfParts } from "./parameters/settings";
import type { ViewerState } from "./viewer_state";

/** How an action of a part changes the state, and what is said about it. */
export type ActionRules<A> = Readonly<{
  reduce: (state: ViewerState, action: A) => ViewerState;
  /** What a step of the history changes, in a few words. */
  name: string;
  /** Changes that follow each other at once, as by a drag, are one step of the history. */
  isGradual?: boolean;
  /** The announcement once a key has made the change. */
  spoken: (state: ViewerState) => string;
}>;

export type PartSettings = Readonly<{
  /** The settings in a bundle that has just opened. */
  start: Partial<SettingsOfParts>;
  /** A row for each setting, in the order that links have. */
  rows: readonly Parameter<ViewerState>[];
  /** Those of the rows that the page's address may set before the `#`. */
  inAddress?: readonly Parameter<ViewerState>[];
  actions?: Readonly<{ [T in keyof PartActions]?: ActionRules<PartActions[T]> }>;
}>;

const byPart = new Map<string, PartSettings>();

/** Adds what a part has; the same part may come again, with another view. */
export function addSettings(part: string, settings: PartSettings): void {
  byPart.set(part, settings);
}

const allParts = () => [...byPart.values()];

/** What the parts of the page have, as declared to the compiler by `declare module`. */
export const startOfParts = (): SettingsOfParts =>
  Object.assign({}, ...allParts().map(({ start }) => start));

export const rowsOfParts = (): readonly Parameter<ViewerState>[] =>
  allParts().flatMap(({ rows }) => rows);

export const addressRowsOfParts = (): readonly Parameter<ViewerState>[] =>
  allParts().flatMap(({ inAddress = [] }) => inAddress);

/** The rules of an action; null: it is none of a part. */
export function rulesOf({ type }: Readonly<{ type: string }>): ActionRules<PartAction> | null {
  for (const { actions = {} } of allParts()) {
    const found = new Map<string, unknown>(Object.entries(actions)).get(type);
    // the table of actions gives each type rules for its own action
    if (found !== undefined) return found as ActionRules<PartAction>;
  }
  return null;
}

/** The state after an action of a part. */
export function withPartAction(state: ViewerState, action: PartAction): ViewerState {
  const rules = rulesOf(action);
  if (rules === null) throw new Error(`no part has the action ${JSON.stringify(action)}`);
  return rules.reduce(state, action);
}

/**
 * Settings and actions that the parts add to the state. The host adds those of its parts before it
 * makes the first state. A viewer without a part therefore lacks the part's settings.
 */
import type { PartAction, PartActions } from "./actions";
import type { Parameter } from "./parameters/kinds";
import type { SettingsOfParts } from "./parameters/settings";
import type { ViewerState } from "./viewer_state";

/** How an action of a part changes the state, and its words. */
export type ActionRules<A> = Readonly<{
  reduce: (state: ViewerState, action: A) => ViewerState;
  /** Name of the action's undo step, in a few words. */
  name: string;
  /** Whether changes in quick succession, for example by a drag, are one step of the history. */
  isGradual?: boolean;
  /** The announcement after a key has made the change. */
  spoken: (state: ViewerState) => string;
}>;

/**
 * Settings of one part, as the member `settings` of its definition.
 *
 * ```ts
 * import { lensesOf, type SwitchParameter } from "./parameters/kinds";
 * import type { PartSettings } from "./part_settings";
 *
 * declare module "./parameters/settings" {
 *   interface Settings {
 *     readonly hasGrid: boolean;
 *   }
 * }
 *
 * // A switch that shows a grid of lines, with a row in the panel and the name `grid` in a link.
 * const GRID: SwitchParameter<Readonly<{ hasGrid: boolean }>> = {
 *   kind: "switch",
 *   id: "grid",
 *   label: "Grid",
 *   link: "grid",
 *   ...lensesOf<Readonly<{ hasGrid: boolean }>>()("hasGrid"),
 *   spoken: ({ hasGrid }) => `Grid: ${hasGrid ? "on" : "off"}`,
 * };
 * export const settings: PartSettings = { start: { hasGrid: false }, rows: [GRID] };
 * print(GRID.spoken(GRID.set({ hasGrid: false }, true))); // "Grid: on"
 * ```
 */
export type PartSettings = Readonly<{
  /** The settings in a bundle that has just opened. */
  start: Partial<SettingsOfParts>;
  /** A row for each setting, in the order of links. */
  rows: readonly Parameter<ViewerState>[];
  /** Rows that the query of the page's address may set. */
  inAddress?: readonly Parameter<ViewerState>[];
  actions?: Readonly<{ [T in keyof PartActions]?: ActionRules<PartActions[T]> }>;
}>;

const byPart = new Map<string, PartSettings>();

/**
 * Adds the settings of a part. If an earlier bundle on this page has added settings of the same
 * part, they are replaced.
 */
export function addSettings(part: string, settings: PartSettings): void {
  byPart.set(part, settings);
}

const allParts = () => [...byPart.values()];

/** Returns the opening values of all settings of parts; `declare module` gives them their types. */
export const startOfParts = (): SettingsOfParts =>
  Object.assign({}, ...allParts().map(({ start }) => start));

export const rowsOfParts = (): readonly Parameter<ViewerState>[] =>
  allParts().flatMap(({ rows }) => rows);

export const addressRowsOfParts = (): readonly Parameter<ViewerState>[] =>
  allParts().flatMap(({ inAddress = [] }) => inAddress);

/** Returns the rules of an action; null if it is not an action of a part. */
export function rulesOf({ type }: Readonly<{ type: string }>): ActionRules<PartAction> | null {
  for (const { actions = {} } of allParts()) {
    const found = new Map<string, unknown>(Object.entries(actions)).get(type);
    // the table of actions gives each type the rules of its own action
    if (found !== undefined) return found as ActionRules<PartAction>;
  }
  return null;
}

/** Returns the state after an action of a part. */
export function withPartAction(state: ViewerState, action: PartAction): ViewerState {
  const rules = rulesOf(action);
  if (rules === null) throw new Error(`no part has the action ${JSON.stringify(action)}`);
  return rules.reduce(state, action);
}

/** Which additions of the stage are hidden. Pure. */
import type { PartSettings } from "../state/part_settings";

export const START_ADDITIONS = {
  /** The IDs of all that the bundle has. */
  additions: [] as readonly string[],
  /** The IDs of those that are hidden. */
  hiddenAdditions: [] as readonly string[],
};

export type AdditionSettings = Readonly<typeof START_ADDITIONS>;

/** Hides these additions and shows all others. `all`: the IDs of all; absent: they are known. */
export type HideAdditions = Readonly<{
  type: "hide-additions";
  hidden: readonly string[];
  all?: readonly string[];
}>;

declare module "../state/parameters/settings" {
  interface Settings extends AdditionSettings {}
}
declare module "../state/actions" {
  interface PartActions {
    "hide-additions": HideAdditions;
  }
}

export const ADDITION_SETTINGS: PartSettings = {
  start: START_ADDITIONS,
  rows: [],
  actions: {
    "hide-additions": {
      reduce: (state, { hidden, all = state.additions }) => ({
        ...state,
        additions: all,
        hiddenAdditions: hidden,
      }),
      name: "additions",
      spoken: ({ hiddenAdditions: { length } }) =>
        length === 0 ? "All added objects are shown" : "Some added objects are hidden",
    },
  },
};

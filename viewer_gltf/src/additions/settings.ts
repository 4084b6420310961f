/** The setting that lists the hidden additions of the stage. Pure. */
import type { PartSettings } from "../state/part_settings";

export const START_ADDITIONS = {
  /** The IDs of all additions of the bundle. */
  additions: [] as readonly string[],
  /** The IDs of the hidden additions. */
  hiddenAdditions: [] as readonly string[],
};

export type AdditionSettings = Readonly<typeof START_ADDITIONS>;

/** Hides these additions and shows all others. `all` lists the IDs of all additions if they are not known yet. */
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
        length === 0
          ? "All objects that were added to the stage are shown"
          : "Some objects that were added to the stage are hidden",
    },
  },
};

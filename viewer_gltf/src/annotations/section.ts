/** The panel's section and the keys for measuring: the tool, the newest measurement, and the finished ones. Pure. */

import { command, controlsOf } from "../panel/control_templates";
import type { Control, PartSection } from "../panel/controls";
import { type KeyGroup, key, keysOf, no } from "../panel/key";
import { measuredText } from "../panel/measured";
import { measurementText } from "../probe/measure";
import type { Action } from "../state/actions";
import { allOf, type Measurement, missing } from "../state/measurements";
import { MEASURE_PARAMETERS } from "../state/parameters/tools";
import { REFUSED } from "../state/refusals";
import type { ViewerState } from "../state/viewer_state";

export const MEASURE_COMMANDS = [
  /** Saves the measurements as a file. */
  "save-csv",
] as const;

declare module "../state/commands" {
  interface CommandNames extends Record<(typeof MEASURE_COMMANDS)[number], true> {}
}

const POINT_NAMES = ["First point", "Second point", "Third point"] as const;
/** Most finished measurements that have a row in the panel; the CSV file lists all of them. */
const MAX_LISTED = 12;

/** Clears the newest measurement or, if it has no points, the last finished one; null: there is none to clear. */
function clearMeasured({ measured, measurements }: ViewerState): Action | null {
  if (measured.length > 0) return { type: "measure", points: [] };
  if (measurements.length === 0) return null;
  return { type: "set-measurements", measurements: measurements.slice(0, -1) };
}

/** @param values for each measured point, the channels' values there, such as `DAPI 1210` */
export function measureSections(
  state: ViewerState,
  values: readonly (readonly string[])[],
): readonly PartSection[] {
  const items = measureItems(state, values);
  return [{ id: "measure", label: "Measure", rank: 30, isDeeper: true, items }];
}

function measureItems(
  state: ViewerState,
  values: readonly (readonly string[])[],
): readonly Control[] {
  const { measured, measuredAs, measurements } = state;
  const isOpen = missing(measuredAs, measured) > 0;
  return [
    ...controlsOf(MEASURE_PARAMETERS, state),
    { kind: "text", id: "distance", label: "Measured", value: measuredText(state) },
    ...POINT_NAMES.slice(0, Math.max(2, measured.length)).map((label, i): Control => {
      const value = (values[i] ?? []).join(" · ");
      return { kind: "text", id: `values-${i}`, label, value };
    }),
    {
      kind: "button",
      id: "finish-measuring",
      label: "Finish and keep the measurement",
      refusal: isOpen ? REFUSED.points : "",
      to: () => ({ type: "finish-measuring" }),
    },
    {
      kind: "button",
      id: "clear-measured",
      label: "Clear",
      name: "Clear the newest measurement",
      refusal: clearMeasured(state) === null ? REFUSED.measured : "",
      to: () => clearMeasured(state) ?? { type: "measure", points: [] },
    },
    ...measurements.slice(-MAX_LISTED).flatMap((each, i) => {
      const index = Math.max(0, measurements.length - MAX_LISTED) + i;
      return listed(each, index, measurements);
    }),
    {
      ...command("save-csv", "Save as CSV"),
      refusal: isOpen && measurements.length === 0 ? REFUSED.measured : "",
    },
  ];
}

function listed(
  { name, kind, points }: Measurement,
  index: number,
  all: readonly Measurement[],
): readonly Control[] {
  const change = (measurements: readonly Measurement[]): Action => ({
    type: "set-measurements",
    measurements,
  });
  return [
    { kind: "text", id: `measurement-${index}`, label: name, value: measurementText(kind, points) },
    {
      kind: "search",
      id: `measurement-${index}-name`,
      label: `Name of ${name}`,
      value: name,
      to: (text) => change(all.map((each, i) => (i === index ? { ...each, name: text } : each))),
    },
    {
      kind: "button",
      id: `measurement-${index}-remove`,
      label: `Remove ${name}`,
      to: () => change(all.filter((_, i) => i !== index)),
    },
  ];
}

const NOT_MEASURED = no(REFUSED.measured);

export const MEASURE_KEYS: readonly KeyGroup[] = [
  {
    name: "Tools",
    rank: 75,
    keys: [
      ...MEASURE_PARAMETERS.flatMap(keysOf),
      key("_", "Finish the measurement and add it to the list", ({ state }) => {
        if (state.measured.length === 0) return NOT_MEASURED;
        if (missing(state.measuredAs, state.measured) > 0) return no(REFUSED.points);
        return { type: "finish-measuring" };
      }),
      key("u", "Clear the newest measurement", ({ state }) => clearMeasured(state) ?? NOT_MEASURED),
      key("(", "Save the measurements as CSV", ({ state }) =>
        allOf(state).length === 0 ? NOT_MEASURED : "save-csv",
      ),
    ],
  },
];

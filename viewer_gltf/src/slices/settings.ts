/** The settings of the three slice planes: whether they show, where they meet, how they are turned. Pure. */

import type { Vec3 } from "../math/vec3";
import type { Remedies } from "../panel/remedies";
import {
  lensesOf,
  type NumberParameter,
  type Parameter,
  type SwitchParameter,
  setTo,
  withValue,
} from "../state/parameters/kinds";
import type { PartSettings } from "../state/part_settings";

/** The slices of a bundle that has just opened. */
export const START_SLICES = {
  /** As pictures beside the specimen, on a flat screen. */
  hasSlicePictures: false,
  /** As planes in the specimen. */
  hasSlicePlanes: false,
  /** The point that all three go through: shares of the specimen's box along x, y, z. */
  sliceX: 0.5,
  sliceY: 0.5,
  sliceZ: 0.5,
  /** The planes' turn from where they lie along the axes: about x, then y, then z, degrees. */
  sliceTurnX_deg: 0,
  sliceTurnY_deg: 0,
  sliceTurnZ_deg: 0,
};

export type SliceSettings = Readonly<typeof START_SLICES>;

/** The point where the slices meet (shares of the specimen's box) and their turn; absent: as it is. */
export type MoveSlices = Readonly<{ type: "move-slices"; at?: Vec3; turn_deg?: Vec3 }>;

declare module "../state/parameters/settings" {
  interface Settings extends SliceSettings {}
}
declare module "../state/actions" {
  interface PartActions {
    "move-slices": MoveSlices;
  }
}

export const NO_SLICES = "No slices are shown: switch pictures or planes on under Slices.";

const lens = lensesOf<SliceSettings>();

export const SLICE_PICTURES: SwitchParameter<SliceSettings> = {
  kind: "switch",
  id: "slice-pictures",
  label: "Pictures",
  name: () => "Slices as pictures",
  link: "slices",
  ...lens("hasSlicePictures"),
  key: ["\\", "Slices as pictures: on or off"],
  spoken: ({ hasSlicePictures }) => `Slices as pictures: ${hasSlicePictures ? "on" : "off"}`,
};

export const SLICE_PLANES: SwitchParameter<SliceSettings> = {
  kind: "switch",
  id: "slice-planes",
  label: "Planes in the specimen",
  link: "planes",
  ...lens("hasSlicePlanes"),
  key: ["|", "Slices as planes in the specimen: on or off"],
  spoken: ({ hasSlicePlanes }) => `Slices in the specimen: ${hasSlicePlanes ? "on" : "off"}`,
};

export const isSliced = ({ hasSlicePictures, hasSlicePlanes }: SliceSettings) =>
  hasSlicePictures || hasSlicePlanes;

const percent = (share: number) => `${(100 * share).toFixed(1)} %`;
const degrees = (angle: number) => `${Number(angle.toFixed(1))}°`;

/** Where the planes meet. */
export const SLICE_AT: readonly NumberParameter<SliceSettings>[] = (
  [
    ["x", "sliceX"],
    ["y", "sliceY"],
    ["z", "sliceZ"],
  ] as const
).map(([axis, field]) => ({
  kind: "number",
  id: `slice-${axis}`,
  label: `Along ${axis}`,
  name: () => `Where the slices meet, along ${axis}`,
  link: `slice-${axis}`,
  ...lens(field),
  limits: [0, 1],
  steps: 200,
  rounded: (share) => Number(share.toFixed(4)),
  text: percent,
  refusal: (on) => (isSliced(on) ? "" : NO_SLICES),
  spoken: (on) => `Slices: ${axis} ${percent(on[field])}`,
}));

/** How they are turned. */
export const SLICE_TURN: readonly NumberParameter<SliceSettings>[] = (
  [
    ["x", "sliceTurnX_deg"],
    ["y", "sliceTurnY_deg"],
    ["z", "sliceTurnZ_deg"],
  ] as const
).map(([axis, field]) => ({
  kind: "number",
  id: `slice-turn-${axis}`,
  label: `Turned about ${axis}`,
  name: () => `Slices, turned about ${axis}`,
  link: `tilt-${axis}`,
  ...lens(field),
  limits: [-180, 180],
  steps: 144,
  rounded: (angle) => Number(angle.toFixed(2)),
  text: degrees,
  refusal: (on) => (isSliced(on) ? "" : NO_SLICES),
  spoken: (on) => `Slices: turned about ${axis} by ${degrees(on[field])}`,
}));

export const SLICE_NUMBERS: readonly NumberParameter<SliceSettings>[] = [
  ...SLICE_AT,
  ...SLICE_TURN,
];

/** In the panel's order. */
export const SLICES: readonly Parameter<SliceSettings>[] = [
  SLICE_PICTURES,
  SLICE_PLANES,
  ...SLICE_NUMBERS,
];

export const SLICE_SETTINGS: PartSettings = {
  start: START_SLICES,
  rows: SLICES,
  actions: {
    "move-slices": {
      reduce: (state, { at = [], turn_deg = [] }) => {
        const moved = at.reduce((on, share, i) => withValue(SLICE_AT[i], on, share), state);
        return turn_deg.reduce((on, angle, i) => withValue(SLICE_TURN[i], on, angle), moved);
      },
      name: "slices",
      isGradual: true,
      spoken: () => "Slices: in the middle, not turned",
    },
  },
};

export const SLICE_WAYS: Remedies = {
  [NO_SLICES]: () => ({ label: "Show slices", to: [setTo(SLICE_PICTURES, true)] }),
};

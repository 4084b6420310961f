/** The settings of the three slices: whether they are shown, where they meet, and how they are rotated. Pure. */

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

/** The slice settings of a bundle that has just opened. */
export const START_SLICES = {
  /** Whether the slices are shown as images beside the specimen, on a flat screen. */
  hasSlicePictures: false,
  /** Whether the slices are shown in the specimen. */
  hasSlicePlanes: false,
  /** The point where the three slices meet, as shares of the specimen's box along x, y, z, 0..1. */
  sliceX: 0.5,
  sliceY: 0.5,
  sliceZ: 0.5,
  /** Rotation of the slices away from the axes, in degrees: Euler angles about x, y and z, in three's order XYZ. */
  sliceTurnX_deg: 0,
  sliceTurnY_deg: 0,
  sliceTurnZ_deg: 0,
};

export type SliceSettings = Readonly<typeof START_SLICES>;

/** Moves the point where the slices meet (shares of the specimen's box) or rotates them. An absent field stays. */
export type MoveSlices = Readonly<{ type: "move-slices"; at?: Vec3; turn_deg?: Vec3 }>;

declare module "../state/parameters/settings" {
  interface Settings extends SliceSettings {}
}
declare module "../state/actions" {
  interface PartActions {
    "move-slices": MoveSlices;
  }
}

export const NO_SLICES =
  "No slices are shown. Switch on “As images” or “In the specimen” under Slices.";

const lens = lensesOf<SliceSettings>();

export const SLICE_PICTURES: SwitchParameter<SliceSettings> = {
  kind: "switch",
  id: "slice-pictures",
  label: "As images",
  name: () => "Slices as images",
  link: "slices",
  ...lens("hasSlicePictures"),
  key: ["\\", "Show or hide the slices as images"],
  spoken: ({ hasSlicePictures }) => `Slices as images: ${hasSlicePictures ? "on" : "off"}`,
};

export const SLICE_PLANES: SwitchParameter<SliceSettings> = {
  kind: "switch",
  id: "slice-planes",
  label: "In the specimen",
  name: () => "Slices in the specimen",
  link: "planes",
  ...lens("hasSlicePlanes"),
  key: ["|", "Show or hide the slices in the specimen"],
  spoken: ({ hasSlicePlanes }) => `Slices in the specimen: ${hasSlicePlanes ? "on" : "off"}`,
};

export const isSliced = ({ hasSlicePictures, hasSlicePlanes }: SliceSettings) =>
  hasSlicePictures || hasSlicePlanes;

const percent = (share: number) => `${(100 * share).toFixed(1)} %`;
const degrees = (angle: number) => `${Number(angle.toFixed(1))}°`;

/** The position where the slices meet. */
export const SLICE_AT: readonly NumberParameter<SliceSettings>[] = (
  [
    ["x", "sliceX"],
    ["y", "sliceY"],
    ["z", "sliceZ"],
  ] as const
).map(([axis, field]) => ({
  kind: "number",
  id: `slice-${axis}`,
  label: `Position along ${axis}`,
  name: () => `Slices: position along ${axis}`,
  link: `slice-${axis}`,
  ...lens(field),
  limits: [0, 1],
  steps: 200,
  rounded: (share) => Number(share.toFixed(4)),
  text: percent,
  refusal: (on) => (isSliced(on) ? "" : NO_SLICES),
  spoken: (on) => `Slices: ${axis} ${percent(on[field])}`,
}));

/** The rotation of the slices. */
export const SLICE_TURN: readonly NumberParameter<SliceSettings>[] = (
  [
    ["x", "sliceTurnX_deg"],
    ["y", "sliceTurnY_deg"],
    ["z", "sliceTurnZ_deg"],
  ] as const
).map(([axis, field]) => ({
  kind: "number",
  id: `slice-turn-${axis}`,
  label: `Rotation about ${axis}`,
  name: () => `Slices: rotation about ${axis}`,
  link: `tilt-${axis}`,
  ...lens(field),
  limits: [-180, 180],
  steps: 144,
  rounded: (angle) => Number(angle.toFixed(2)),
  text: degrees,
  refusal: (on) => (isSliced(on) ? "" : NO_SLICES),
  spoken: (on) => `Slices: rotated about ${axis} by ${degrees(on[field])}`,
}));

export const SLICE_NUMBERS: readonly NumberParameter<SliceSettings>[] = [
  ...SLICE_AT,
  ...SLICE_TURN,
];

/** All settings of the slices, in the panel's order. */
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
      spoken: () => "Slices: centred and straight",
    },
  },
};

export const SLICE_WAYS: Remedies = {
  [NO_SLICES]: () => ({ label: "Show slices", to: [setTo(SLICE_PICTURES, true)] }),
};

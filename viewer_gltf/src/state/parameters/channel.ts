/** The parameters that each channel has. Pure. */
import type { Rgb } from "../../math/color";
import {
  type ColourParameter,
  lensesOf,
  type NumberParameter,
  type Parameter,
  type SwitchParameter,
} from "./kinds";

/** Settings of a channel in a bundle that has just opened; the colour is the bundle's. */
export const START_CHANNEL = {
  /** Factor to the opacity of the surface and of the volume, 0..1. */
  opacity: 1,
  /** Whether the channel may be drawn as a volume. */
  volume: true,
};

export type ChannelSettings = Readonly<typeof START_CHANNEL & { color: Rgb }>;

type Channel = ChannelSettings & Readonly<{ name: string }>;

const lens = lensesOf<Channel>();
const percent = (value: number) => `${Math.round(100 * value)} %`;

export const COLOR: ColourParameter<Channel> = {
  kind: "colour",
  id: "color",
  label: "Colour",
  name: ({ name }) => `Colour of ${name}`,
  link: "c",
  ...lens("color"),
  spoken: () => "new colour",
};

export const OPACITY: NumberParameter<Channel> = {
  kind: "number",
  id: "opacity",
  label: "Opacity",
  name: ({ name }) => `Opacity of ${name}`,
  about: "How dense the channel looks, as a surface and as a volume.",
  link: "o",
  ...lens("opacity"),
  limits: [0, 1],
  steps: 100,
  rounded: (value) => value,
  text: percent,
  keys: {
    less: ["o", "Less opacity"],
    more: ["O", "More opacity"],
    next: (value, direction) => Math.round(100 * (value + 0.05 * direction)) / 100,
  },
  spoken: ({ opacity }) => `opacity ${percent(opacity)}`,
};

export const VOLUME: SwitchParameter<Channel> = {
  kind: "switch",
  id: "volume",
  label: "Volume",
  name: ({ name }) => `Draw ${name} as a volume`,
  about: "A channel whose volume is off stays a surface in every mode.",
  link: "n",
  ...lens("volume"),
  key: ["v", "Volume on or off"],
  spoken: ({ volume }) => `volume ${volume ? "on" : "off"}`,
};

export const CHANNEL: readonly Parameter<Channel>[] = [COLOR, OPACITY, VOLUME];

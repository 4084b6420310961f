/** The settings of saved images. Pure. */
import { type ChoiceParameter, lensesOf } from "../state/parameters/kinds";
import type { PartSettings } from "../state/part_settings";

const PICTURE_SIZES = ["1", "2", "4"] as const;
type PictureSize = (typeof PICTURE_SIZES)[number];

const START_CAPTURE = {
  /** Factor by which a saved image is larger than the view on the screen. */
  pictureSize: "2" as PictureSize,
};

type CaptureSettings = Readonly<typeof START_CAPTURE>;

declare module "../state/parameters/settings" {
  interface Settings extends CaptureSettings {}
}

const lens = lensesOf<CaptureSettings>();

export const PICTURE_SIZE: ChoiceParameter<CaptureSettings, PictureSize> = {
  kind: "choice",
  id: "picture-size",
  label: "Picture",
  ...lens("pictureSize"),
  values: PICTURE_SIZES,
  names: { "1": "1 x", "2": "2 x", "4": "4 x" },
  key: ["0", "Next size of saved pictures: 1, 2 or 4 times the screen"],
  spoken: ({ pictureSize }) => `Pictures: ${pictureSize} times the screen`,
};

export const CAPTURE_SETTINGS: PartSettings = { start: START_CAPTURE, rows: [PICTURE_SIZE] };

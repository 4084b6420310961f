/** The names of the settings on the page, and of their values. */

export const NAMES = {
  title: "Title",
  preset: "Kind of image",
  series: "Series",
  background: "Background",
  spacing: "Voxel spacing",
  channels: "Channels",
} as const;

/** Names of the presets that people know; other presets appear under their IDs. */
export const PRESETS: Readonly<Record<string, string>> = {
  cycif: "Confocal or light sheet, thin sections",
  lightsheet: "Light sheet, cleared tissue",
  em: "Electron microscopy",
  mri: "MRI",
  ct: "CT: skin",
  "ct-bone": "CT: bones",
  pet: "PET or SPECT",
  vessels: "Vessels (angiogram)",
  none: "Another kind",
};

/** Names for the brightness of the background around the structures of an image. */
export const BACKGROUNDS: Readonly<Record<string, string>> = {
  dark: "Dark",
  bright: "Bright",
};

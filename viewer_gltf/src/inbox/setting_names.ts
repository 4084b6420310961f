/** The names of the settings on the page, and of their values. */

export const NAMES = {
  title: "Title",
  preset: "Kind of image",
  series: "Series",
  background: "Background",
  spacing: "Voxel spacing",
  channels: "Channels",
} as const;

/** Presets in a person's words; the others stand under their own names. */
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

/** The names of the ground around the structures of an image. */
export const BACKGROUNDS: Readonly<Record<string, string>> = {
  dark: "Dark",
  bright: "Bright",
};

/** The colour themes of the page and of the flat background. */
export type Theme = "light" | "dark";

/** Background colour of the flat view far from the specimen, sRGB. Stereo uses the dark one. */
export const FAR = { dark: 0x0b0d12, light: 0xe3e7ee } as const;

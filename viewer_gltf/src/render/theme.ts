/** The two looks of the page and of the flat picture's background. */
export type Theme = "light" | "dark";

/** Background of the flat picture far from the specimen, sRGB. Stereo has the dark one. */
export const FAR = { dark: 0x0b0d12, light: 0xe3e7ee } as const;

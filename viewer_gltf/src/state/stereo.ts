/** The kinds of stereo that this browser offers. */

/** Whether a kind of stereo can be used, and the reason if not. */
export type XrSupport = Readonly<{ isAvailable: boolean; reason: string }>;

export type StereoSupport = Readonly<{
  stereo: XrSupport;
  /** Whether the split screen of a phone can be used; null: this viewer has no split screen. */
  split: XrSupport | null;
  /** Whether the specimen can stand in the user's own room (augmented reality). */
  hasRoom: boolean;
  /** Whether the browser reads QR codes. */
  canScan: boolean;
  /** Returns what is wrong with the text of a Cardboard viewer's QR code; "": nothing. */
  faultOfCode: (code: string) => string;
}>;

/** Least and largest number of CSS pixels per inch of a screen. */
export const PER_INCH = [60, 240] as const;

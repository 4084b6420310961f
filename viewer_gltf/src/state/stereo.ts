/** The stereo that this browser offers. */

/** Whether it can be used, and if not, why, in words. */
export type XrSupport = Readonly<{ isAvailable: boolean; reason: string }>;

export type StereoSupport = Readonly<{
  stereo: XrSupport;
  /** null: there is none in this viewer. */
  split: XrSupport | null;
  /** Whether the specimen can stand in the user's own room. */
  hasRoom: boolean;
  /** Whether the browser reads QR codes. */
  canScan: boolean;
  /** The fault of the text of a phone viewer's code, in words; "": none. */
  faultOfCode: (code: string) => string;
}>;

/** CSS pixels in an inch that a screen may have. */
export const PER_INCH = [60, 240] as const;

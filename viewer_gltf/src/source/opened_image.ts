import type { Rgb } from "../math/color";
import type { CoarseVolume, Triple } from "./coarse_volume";
import type { Window } from "./find_window";

/** A channel that is shown. */
export type ImageChannel = Readonly<{
  name: string;
  /** Linear RGB; null: the source states none. */
  color: Rgb | null;
  /** Values that the source states as the ends of the window; null: it states none. */
  window: Window | null;
  /** Whether the channel is shown when the source opens. */
  opens: boolean;
  /** Reads the voxels, and reports the share of them that has arrived, 0..1. Throws SourceError. */
  read: (onShare?: (share: number) => void) => Promise<CoarseVolume>;
}>;

/** An opened source: its metadata, and the functions that read its voxels. */
export type OpenedImage = Readonly<{
  name: string;
  /** Number of voxels of the finest resolution level (z, y, x), and their distance in um. */
  shape: Triple;
  spacing_um: Triple;
  /** 4 x 4, column-major, um: from the world of the voxels, whose origin is the first one, to the world. */
  placement: readonly number[];
  /** Whether the directions to a patient's left, posterior and superior side are known. */
  hasSides: boolean;
  /** Whether stored values may be below 0. */
  isSigned: boolean;
  channels: readonly ImageChannel[];
  /** Sentences for the user, which appear as notices do. */
  notes: readonly string[];
}>;

/** Reports the progress as a text for the user. */
export type Report = (text: string) => void;

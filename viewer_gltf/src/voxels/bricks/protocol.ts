/** Frames and messages of `/bricks`; see docs/brick-stream.md. */
import { BundleError } from "../../bundle/errors";

export const TABLE_FRAME = 1;
export const BRICKS_FRAME = 2;

/**
 * Pixels. Longest edge of a texel on the screen; if it is longer, the client requests finer texels.
 */
export const TEXEL_PX = 1;

/** The camera in the world, um. */
export type BrickView = Readonly<{
  /** Matrix from um of the world to the camera's clip space, column-major. */
  clip: readonly number[];
  eye: readonly [number, number, number];
  gaze: readonly [number, number, number];
  pixels_per_radian: number;
}>;

type Part = Readonly<{ tree: number; at: number; bytes: Uint8Array<ArrayBuffer> }>;
export type Frame = Readonly<{ kind: number; sequence: number; parts: readonly Part[] }>;

export type ServerMessage =
  | Readonly<{ type: "welcome" }>
  | Readonly<{
      type: "tree";
      tree: number;
      tile: string;
      channel: string;
      source: string;
      table: string;
      table_bytes: number;
      table_follows: boolean;
    }>
  | Readonly<{ type: "done"; view: number; reason: "complete" | "budget" | "cancelled" }>
  | Readonly<{ type: "error"; message: string; tile: string; channel: string }>;

const HEAD = 16;
const PART = 12;

/** Reads a binary frame. Throws BundleError. */
export function parseFrame(data: ArrayBuffer): Frame {
  const view = new DataView(data);
  const fault = () => new BundleError("/bricks: a frame is damaged or not of version 1");
  if (data.byteLength < HEAD || view.getUint8(1) !== 1) throw fault();
  const count = view.getUint32(12, true);
  let from = HEAD + count * PART;
  if (from > data.byteLength) throw fault();
  const parts: Part[] = [];
  for (let i = 0; i < count; i++) {
    const at = HEAD + i * PART;
    const length = view.getUint32(at + 8, true);
    if (from + length > data.byteLength) throw fault();
    parts.push({
      tree: view.getUint32(at, true),
      at: view.getUint32(at + 4, true),
      bytes: new Uint8Array(data, from, length),
    });
    from += length;
  }
  if (from !== data.byteLength) throw fault();
  return { kind: view.getUint8(0), sequence: view.getUint32(4, true), parts };
}

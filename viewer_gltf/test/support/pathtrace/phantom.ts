/** The specimen of the path tracer's tests: blobs in a block, in white light from all sides. */
import { seeded } from "../seeded";
import type { Run } from "./harness";

export const SIZE = [35, 35, 35] as const;

/** Returns blobs of random intensity in a block, whose outermost texels are empty. */
function blobs(size: readonly [number, number, number], seed: number): number[] {
  const random = seeded(seed);
  const [nx, ny, nz] = size;
  const texels = new Array<number>(nx * ny * nz).fill(0);
  for (let blob = 0; blob < 5; blob++) {
    const center = size.map((n) => n * (0.3 + 0.4 * random()));
    const radius = 5 + 6 * random();
    const top = 100 + 155 * random();
    texels.forEach((value, i) => {
      const p = [i % nx, Math.floor(i / nx) % ny, Math.floor(i / (nx * ny))];
      const off = Math.hypot(...p.map((v, k) => v - center[k]));
      texels[i] = Math.max(
        value,
        Math.round(top * Math.min(1, Math.max(0, 2 - (2 * off) / radius))),
      );
    });
  }
  return texels;
}

/** Returns 256 opacities, from 0 up to `top` of 255. */
export const opacityRamp = (top: number) =>
  Array.from({ length: 256 }, (_, i) => Math.round((top * i) / 255));

export const BASE: Run = {
  size: SIZE,
  texels: blobs(SIZE, 7),
  spacing_um: [1, 1, 1.4],
  opacities: opacityRamp(120),
  color: [1, 1, 1],
  settings: {},
  environment: { width: 2, height: 1, rgb: [1, 1, 1, 1, 1, 1] },
  camera: { eye: [16, -16, 110], target: [16, -16, 22], fov_deg: 24 },
  pixels: 32,
  passes: 64,
};

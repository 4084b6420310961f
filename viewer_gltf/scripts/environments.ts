/**
 * Writes the two built-in environments: public/environments/NAME.hdr, Radiance's RGBE (Ward 1991),
 * 64 x 32 directions, y up. `npx tsx scripts/environments.ts`
 */
import { mkdir, writeFile } from "node:fs/promises";

const WIDTH = 64;
const HEIGHT = 32;
const FOLDER = new URL("../public/environments/", import.meta.url);

type Vec3 = readonly [number, number, number];

/** Radiance of each environment by direction; x to the right, y up, z towards the viewer. */
const ROOMS: Readonly<Record<string, (dir: Vec3) => Vec3>> = {
  // A grey room with a wide soft light above the viewer, and a strip of light on each side.
  studio: ([x, y, z]) => {
    const above = Math.exp(-6 * (1 - (0.75 * y + 0.66 * z)));
    const strips = Math.exp(-40 * (Math.abs(x) - 0.92) ** 2) * Math.exp(-3 * y * y);
    const grey = 0.28 + 0.1 * y;
    return [
      grey + 2.6 * above + 0.5 * strips,
      grey + 2.5 * above + 0.55 * strips,
      grey + 2.35 * above + 0.65 * strips,
    ];
  },
  // A clear sky, brighter towards the horizon, with a low warm sun above dark ground.
  sky: ([x, y, z]) => {
    const sun = 60 * Math.exp(-180 * (1 - (0.55 * x + 0.5 * y + 0.67 * z)));
    if (y < 0) return [0.12 + 0.05 * y, 0.11 + 0.05 * y, 0.1 + 0.05 * y];
    const horizon = (1 - y) ** 3;
    return [
      0.25 + 0.55 * horizon + sun,
      0.42 + 0.45 * horizon + 0.9 * sun,
      0.85 + 0.2 * horizon + 0.75 * sun,
    ];
  },
};

function rgbe(color: Vec3): number[] {
  const largest = Math.max(...color);
  if (largest < 1e-32) return [0, 0, 0, 0];
  const exponent = Math.floor(Math.log2(largest)) + 1;
  return [
    ...color.map((v) => Math.min(255, Math.floor((v / 2 ** exponent) * 256))),
    exponent + 128,
  ];
}

await mkdir(FOLDER, { recursive: true });
for (const [name, bright] of Object.entries(ROOMS)) {
  const texels: number[] = [];
  for (let row = 0; row < HEIGHT; row++) {
    for (let column = 0; column < WIDTH; column++) {
      const down = ((row + 0.5) / HEIGHT) * Math.PI;
      const round = ((column + 0.5) / WIDTH) * 2 * Math.PI; // angle that begins at -z and increases towards +x
      const dir = [
        Math.sin(down) * Math.sin(round),
        Math.cos(down),
        -Math.sin(down) * Math.cos(round),
      ];
      texels.push(...rgbe(bright([dir[0], dir[1], dir[2]])));
    }
  }
  const head = `#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y ${HEIGHT} +X ${WIDTH}\n`;
  await writeFile(
    new URL(`${name}.hdr`, FOLDER),
    Buffer.concat([Buffer.from(head, "latin1"), Buffer.from(texels)]),
  );
}

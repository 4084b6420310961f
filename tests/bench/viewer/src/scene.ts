/** The scene that scene.py writes, and the interface of a renderer. */
export type Triple = readonly [number, number, number];

/** World: x right, y up, z to the viewer; um. With fov_deg perspective, else parallel. */
export type Camera = Readonly<{
  eye_um: Triple;
  target_um: Triple;
  fov_deg: number | null;
  half_height_um: number | null;
}>;

export type About = Readonly<{
  /** Voxels along x, y, z. */
  size: Triple;
  spacing_um: Triple;
  /** The box from the second voxels' centres to the last but one: an apron of one voxel. */
  low_um: Triple;
  high_um: Triple;
  /** 256 RGBA of 8 bits: RGB is a factor of the colour, A the opacity over a voxel's length. */
  table: readonly number[];
  /** Linear RGB. */
  color: Triple;
  cameras: Readonly<Record<string, Camera>>;
  size_px: readonly [number, number];
}>;

export type Scene = Readonly<{
  about: About;
  /** x fastest, then y, then z; rows run against world y; voxel 0 is centred at the origin. */
  voxels: Uint8Array<ArrayBuffer>;
  /** Smallest and largest value of every brick of 8^3, interleaved. */
  bricks: Uint8Array<ArrayBuffer>;
}>;

/** A number that the renderer's users set, such as the step in voxels; its meaning differs. */
export type Setting = number;

export interface Renderer {
  /** Prepare to draw into `parent`, which has the size of the picture. */
  setup(scene: Scene, camera: Camera, setting: Setting, parent: HTMLElement): Promise<void>;
  /** Start to draw one picture. The caller waits for it by reading its pixels. */
  draw(): void;
  /** The context that holds the picture. */
  readonly gl: WebGL2RenderingContext;
  /** Mean number of steps of the rays that meet the volume, where the renderer counts them. */
  countSteps?(): number;
}

export async function fetchScene(name: string): Promise<Scene> {
  const about = (await (await fetch(`${name}.json`)).json()) as About;
  const bytes = new Uint8Array(await (await fetch(`${name}.bin`)).arrayBuffer());
  const count = about.size[0] * about.size[1] * about.size[2];
  return { about, voxels: bytes.slice(0, count), bricks: bytes.slice(count) };
}

/** Return the voxels with rows along world y, which other renderers need. */
export function upright({ about, voxels }: Scene): Uint8Array<ArrayBuffer> {
  const [nx, ny, nz] = about.size;
  const flipped = new Uint8Array(voxels.length);
  for (let z = 0; z < nz; z++) {
    for (let y = 0; y < ny; y++) {
      const from = (z * ny + ny - 1 - y) * nx;
      flipped.set(voxels.subarray(from, from + nx), (z * ny + y) * nx);
    }
  }
  return flipped;
}

/** Return the scene's colour as sRGB 0..1, because other renderers blend encoded colours. */
export function shownColor({ color }: About): number[] {
  return color.map((v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
}

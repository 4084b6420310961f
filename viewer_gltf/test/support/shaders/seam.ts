/**
 * Two tiles side by side with two overlapping channels. Every ray must give the same colour,
 * wherever it crosses the border.
 */
import {
  Data3DTexture,
  LinearFilter,
  PerspectiveCamera,
  RGFormat,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { Cuts } from "../../../src/gpu/clip_planes";
import { EncodePass } from "../../../src/gpu/encode_pass";
import { Eyes } from "../../../src/gpu/eyes";
import { byteTarget } from "../../../src/gpu/float_targets";
import { linearTarget } from "../../../src/gpu/linear_target";
import { DepthPass } from "../../../src/render/depth_pass";
import { TileMarch } from "../../../src/volumes/tile_raymarch";
import { makeFrame } from "../../../src/voxels/march_frame";
import { cube, PIXELS } from "./cube";

const SIDE = 51;
const EDGE = SIDE - 3;
const AWAY = 2000;
/** Extents of the channels along z, voxels. */
const SLABS = [
  [8, 32],
  [16, 40],
] as const;
const COLORS = [
  [0.9, 0.05, 0.05],
  [0.05, 0.8, 0.1],
] as const;

function slabs(): Data3DTexture {
  const texels = new Uint8Array(2 * SIDE ** 3);
  for (let i = 0; i < SIDE ** 3; i++) {
    const z = Math.floor(i / SIDE ** 2);
    SLABS.forEach(([from, to], c) => {
      texels[2 * i + c] = z >= from && z < to ? 255 : 0;
    });
  }
  const texture = new Data3DTexture(texels, SIDE, SIDE, SIDE);
  texture.format = RGFormat;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}

/** Returns the mean colour of each column, 0..255, of a view that the border crosses at every depth. */
export function columnsOverBorder(): number[][] {
  const renderer = new WebGLRenderer();
  const depth = new DepthPass(new Cuts());
  const frame = makeFrame(depth.texture);
  frame.uEye.value.set(0, 0, PIXELS, PIXELS);
  frame.uPart.value.set(0, 0, PIXELS, PIXELS);
  const table = new Uint8Array(1024).fill(255);
  for (let i = 0; i < 256; i++) table[4 * i + 3] = Math.round((8 * i) / 255);
  const texture = slabs();
  const scene = new Scene();
  const camera = new PerspectiveCamera(0.8, 1, AWAY / 2, AWAY * 2);
  camera.position.set(EDGE + AWAY * Math.SQRT1_2, -EDGE / 2, EDGE / 2 + AWAY * Math.SQRT1_2);
  camera.lookAt(EDGE, -EDGE / 2, EDGE / 2);
  camera.updateMatrixWorld();
  for (const left of [0, EDGE]) {
    const march = new TileMarch(cube(SIDE, left), 2, frame);
    const bricks = [new Uint8Array(1), new Uint8Array(1)];
    march.show(
      { channels: ["A", "B"], level: 0, texture, index: null, bricks, cells: null },
      null,
      1,
      1,
    );
    march.setAppearances(COLORS.map((color) => ({ color, table, isInDisc: false })));
    march.sortBy(camera.position);
    march.shareWith(new Vector3(0, -EDGE, 0), new Vector3(2 * EDGE, 0, EDGE), 2);
    scene.add(march.mesh);
  }
  renderer.setSize(PIXELS, PIXELS, false);
  const eyes = new Eyes();
  eyes.followScreen(renderer, camera);
  depth.render(renderer, new Scene(), eyes, []);
  const light = linearTarget(renderer);
  const encoded = byteTarget();
  light.setSize(PIXELS, PIXELS);
  encoded.setSize(PIXELS, PIXELS);
  renderer.setClearColor(0, 0);
  renderer.setRenderTarget(light);
  renderer.render(scene, camera);
  new EncodePass().render(renderer, light, encoded);
  const rgba = new Uint8Array(4 * PIXELS * PIXELS);
  renderer.readRenderTargetPixels(encoded, 0, 0, PIXELS, PIXELS, rgba);
  renderer.dispose();
  return Array.from({ length: PIXELS }, (_, x) =>
    [0, 1, 2].map((k) => {
      let sum = 0;
      for (let y = 0; y < PIXELS; y++) sum += rgba[4 * (y * PIXELS + x) + k];
      return sum / PIXELS;
    }),
  );
}

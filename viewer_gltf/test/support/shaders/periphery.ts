/** A frame for two eyes with known lens centres: which pixels are marched, and which are filled. */
import { DepthTexture, PerspectiveCamera, Scene, Vector4, WebGLRenderer } from "three";
import { Eyes } from "../../../src/gpu/eyes";
import { CHUNKS } from "../../../src/gpu/glsl_chunks";
import { includeChunks } from "../../../src/gpu/glsl_include";
import { ScreenPass } from "../../../src/gpu/screen_pass";
import { MarchPass } from "../../../src/render/raymarch_pass";
import { makeFrame } from "../../../src/voxels/march_frame";

/** Pixels along each edge of one eye's part. */
const SIDE = 90;
/** Tangents of the sides of each eye's view: left, right, bottom, top. */
const SIDES = [
  [-1.2, 0.6, -1, 0.8],
  [-0.6, 1.2, -1, 0.8],
] as const;

/** A slope from left to right, in the pixels that are marched. */
const SLOPE = includeChunks(
  `precision highp float;
uniform vec4 uPart;
#include <chunks/periphery>
layout(location = 0) out vec4 oColor;
layout(location = 1) out vec4 oBehind;
void main() {
  if (isLeftOut(ivec2(gl_FragCoord.xy), uPart)) discard;
  oColor = vec4((gl_FragCoord.x - uPart.x) / uPart.z, shareOfSteps(gl_FragCoord.xy, uPart), 0.0, 1.0);
  oBehind = oColor;
}`,
  CHUNKS,
);

/** A pixel: its eye, the angle from the eye's axis in degrees, whether it was marched, and its error. */
export type SparsePixel = Readonly<{
  eye: number;
  angle: number;
  isMarched: boolean;
  steps: number;
  /** Difference from the slope, in steps per pixel. */
  off: number;
}>;

export function sparsePixels(): readonly SparsePixel[] {
  const renderer = new WebGLRenderer();
  const frame = makeFrame(new DepthTexture(1, 1));
  const march = new MarchPass(renderer, frame);
  const pass = new ScreenPass(SLOPE, { uLens: frame.uLens });
  pass.uPart.value = frame.uPart.value;
  const eyes = new Eyes();
  eyes.sync(
    SIDES.map(([left, right, bottom, top], i) => {
      const camera = new PerspectiveCamera();
      camera.projectionMatrix.makePerspective(left, right, top, bottom, 1, 10);
      return [camera, new Vector4(i * SIDE, 0, SIDE, SIDE)] as const;
    }),
  );
  const scene = new Scene().add(pass.scene.children[0]);
  march.render(scene, eyes, 1);
  const [drawn, shown] = [march.target, march.filled.target].map((target) => {
    const rgba = new Float32Array(4 * 2 * SIDE * SIDE);
    renderer.setRenderTarget(target);
    const gl = renderer.getContext() as WebGL2RenderingContext;
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(0, 0, 2 * SIDE, SIDE, gl.RGBA, gl.FLOAT, rgba);
    return rgba;
  });
  renderer.dispose();
  return Array.from({ length: 2 * SIDE * SIDE }, (_, i) => {
    const [column, row] = [i % (2 * SIDE), Math.floor(i / (2 * SIDE))];
    const eye = column < SIDE ? 0 : 1;
    const [left, right, bottom, top] = SIDES[eye];
    const at = (column - eye * SIDE + 0.5) / SIDE;
    const x = left + (right - left) * at;
    const y = bottom + ((top - bottom) * (row + 0.5)) / SIDE;
    return {
      eye,
      angle: (Math.atan(Math.hypot(x, y)) * 180) / Math.PI,
      isMarched: drawn[4 * i + 3] > 0,
      steps: drawn[4 * i + 1],
      off: Math.abs(shown[4 * i] - at) * SIDE,
    };
  });
}

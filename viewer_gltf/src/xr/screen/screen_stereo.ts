/**
 * Stereo on the page's own screen: an anaglyph for red-cyan glasses, or two images side by side.
 */
import {
  Camera,
  Matrix3,
  type PerspectiveCamera,
  type Vector3,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import type { Eyes } from "../../gpu/eyes";
import { CHUNKS } from "../../gpu/glsl_chunks";
import { includeChunks } from "../../gpu/glsl_include";
import { ScreenPass } from "../../gpu/screen_pass";
import type { ScreenStereo } from "../../state/parameters/tools";
import anaglyph from "./anaglyph.frag.glsl?raw";
import { LEFT, type Projection, RIGHT } from "./dubois";
import { ScreenEyes } from "./screen_eyes";

const matrixOf = (projection: Projection) => ({
  value: new Matrix3().fromArray(projection.flat()).transpose(),
});

export class ScreenImages {
  private readonly eyes = new ScreenEyes();
  /**
   * Images of both eyes for an anaglyph, the left eye's on the left, with colours encoded like the
   * canvas's.
   */
  private readonly target = new WebGLRenderTarget(1, 1, { depthBuffer: false });
  private readonly pass = new ScreenPass(includeChunks(anaglyph, CHUNKS), {
    uEyes: { value: this.target.texture },
    uLeft: matrixOf(LEFT),
    uRight: matrixOf(RIGHT),
  });
  private readonly anyCamera = new Camera();

  constructor(private readonly renderer: WebGLRenderer) {}

  /** Places the eyes for this frame; see ScreenEyes. */
  sync(
    eyes: Eyes,
    camera: PerspectiveCamera,
    focus: Vector3,
    pupils_m: number,
    kind: ScreenStereo,
  ): void {
    const { drawingBufferWidth: width, drawingBufferHeight: height } = this.renderer.getContext();
    const across = kind === "anaglyph" ? width : Math.floor(width / 2);
    if (kind === "anaglyph") this.target.setSize(2 * across, height);
    this.eyes.sync(camera, focus, pupils_m, [across, height]);
    eyes.sync(this.eyes.pairs);
  }

  present(draw: () => void): void {
    const { renderer } = this;
    renderer.setRenderTarget(this.target);
    draw();
    renderer.setRenderTarget(null);
    renderer.render(this.pass.scene, this.anyCamera);
  }

  dispose(): void {
    this.target.dispose();
    this.pass.dispose();
  }
}

/** The running mean of frames of one colour each. */
import { WebGLRenderer } from "three";
import { linearTarget } from "../../../src/gpu/linear_target";
import { RunningMean } from "../../../src/gpu/running_mean";

/** Returns the red of the running mean after each frame of these reds. */
export function meansOf(reds: readonly number[]): number[] {
  const renderer = new WebGLRenderer();
  const mean = new RunningMean(renderer);
  const picture = linearTarget(renderer, { count: 2 });
  picture.setSize(4, 4);
  const means = reds.map((red) => {
    renderer.setRenderTarget(picture);
    renderer.getContext().clearColor(red, 0, 0, 1);
    renderer.getContext().clear(renderer.getContext().COLOR_BUFFER_BIT);
    mean.add(picture);
    return redOf(renderer, mean);
  });
  renderer.dispose();
  return means;
}

function redOf(renderer: WebGLRenderer, mean: RunningMean): number {
  renderer.setRenderTarget(mean.target);
  const gl = renderer.getContext() as WebGL2RenderingContext;
  const texel = new Float32Array(4);
  gl.readBuffer(gl.COLOR_ATTACHMENT0);
  gl.readPixels(2, 2, 1, 1, gl.RGBA, gl.FLOAT, texel);
  return texel[0];
}

/**
 * Render targets of linear light. Blending in them adds up like light, at a tile's border as well
 * as inside a tile. They have half floats if the device can draw into and multisample them.
 * Otherwise they have eight bits that the GPU itself encodes and decodes, which every WebGL 2 has;
 * the image is then the same but clipped at white.
 */
import {
  HalfFloatType,
  LinearSRGBColorSpace,
  NearestFilter,
  SRGBColorSpace,
  UnsignedByteType,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";

/** Samples per pixel: as many as the browser's own anti-aliasing uses. */
const SAMPLES = 4;

/** The part of a context that is used, so that tests need no GPU. */
export type LinearContext = Pick<
  WebGL2RenderingContext,
  "getExtension" | "getInternalformatParameter" | "RENDERBUFFER" | "RGBA16F" | "SAMPLES"
>;

/** Whether half floats can be drawn into, blended and multisampled. */
export function hasHalfFloats(gl: LinearContext): boolean {
  const isDrawable =
    gl.getExtension("EXT_color_buffer_float") ?? gl.getExtension("EXT_color_buffer_half_float");
  if (isDrawable === null) return false;
  const samples = gl.getInternalformatParameter(gl.RENDERBUFFER, gl.RGBA16F, gl.SAMPLES);
  return Array.from((samples ?? []) as Int32Array).some((count) => count >= SAMPLES);
}

/** Returns a target with `count` textures: the given one, or a new one in its place. */
export function withTextures(
  renderer: WebGLRenderer,
  target: WebGLRenderTarget,
  count: number,
): WebGLRenderTarget {
  if (target.textures.length === count) return target;
  target.dispose();
  return linearTarget(renderer, { count });
}

/** @param count number of textures that are drawn at once */
export function linearTarget(
  renderer: WebGLRenderer,
  options: Readonly<{ hasDepth?: boolean; isMultisampled?: boolean; count?: number }> = {},
): WebGLRenderTarget {
  const { hasDepth = false, isMultisampled = false, count = 1 } = options;
  const isHalf = hasHalfFloats(renderer.getContext() as WebGL2RenderingContext);
  return new WebGLRenderTarget(1, 1, {
    count,
    type: isHalf ? HalfFloatType : UnsignedByteType,
    colorSpace: isHalf ? LinearSRGBColorSpace : SRGBColorSpace,
    depthBuffer: hasDepth,
    stencilBuffer: hasDepth,
    samples: isMultisampled ? SAMPLES : 0,
    minFilter: NearestFilter,
    magFilter: NearestFilter,
  });
}

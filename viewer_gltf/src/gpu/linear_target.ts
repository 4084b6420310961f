/**
 * Targets of linear light: whatever is blended there adds up as light does, at a tile's border as
 * within a tile. Half floats where the device draws and multisamples them; elsewhere eight bits that
 * the GPU itself encodes and decodes, which every WebGL 2 has: the same picture, cut off at white.
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

/** Samples of a pixel: as many as the browser's own anti-aliasing has. */
const SAMPLES = 4;

/** The part of a context that is asked, so that tests need none. */
export type LinearContext = Pick<
  WebGL2RenderingContext,
  "getExtension" | "getInternalformatParameter" | "RENDERBUFFER" | "RGBA16F" | "SAMPLES"
>;

/** Whether half floats can be drawn into, blended, and multisampled. */
export function hasHalfFloats(gl: LinearContext): boolean {
  const isDrawable =
    gl.getExtension("EXT_color_buffer_float") ?? gl.getExtension("EXT_color_buffer_half_float");
  if (isDrawable === null) return false;
  const samples = gl.getInternalformatParameter(gl.RENDERBUFFER, gl.RGBA16F, gl.SAMPLES);
  return Array.from((samples ?? []) as Int32Array).some((count) => count >= SAMPLES);
}

/** @param count textures that are drawn at once */
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

/** Textures and render targets of floats, read texel by texel. */
import {
  Camera,
  Data3DTexture,
  DataTexture,
  FloatType,
  type HalfFloatType,
  NearestFilter,
  RedFormat,
  RGBAFormat,
  type RGFormat,
  type Scene,
  type Texture,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";

const EXACT = { minFilter: NearestFilter, magFilter: NearestFilter } as const;
const ANY_CAMERA = new Camera();

export function nothing(): { value: Texture | null } {
  return { value: null };
}

/** @param count number of textures that are drawn at once */
export function floatTarget(count: number, type: typeof FloatType | typeof HalfFloatType) {
  return new WebGLRenderTarget(1, 1, { count, type, depthBuffer: false, ...EXACT });
}

export function byteTarget(): WebGLRenderTarget {
  return new WebGLRenderTarget(1, 1, { depthBuffer: false, ...EXACT });
}

export function floatTexture(
  width: number,
  height: number,
  format: typeof RGBAFormat | typeof RGFormat,
  data?: Float32Array<ArrayBuffer>,
): DataTexture {
  const parts = format === RGBAFormat ? 4 : 2;
  const texels = data ?? new Float32Array(width * height * parts);
  const texture = new DataTexture(texels, width, height, format, FloatType);
  Object.assign(texture, EXACT);
  texture.needsUpdate = true;
  return texture;
}

export function float3D(data: Float32Array<ArrayBuffer>, size: readonly [number, number, number]) {
  const texture = new Data3DTexture(data, ...size);
  texture.format = RedFormat;
  texture.type = FloatType;
  Object.assign(texture, EXACT);
  texture.unpackAlignment = 4;
  texture.needsUpdate = true;
  return texture;
}

/** Draws over a whole target after setting its size. */
export function drawWhole(
  renderer: WebGLRenderer,
  scene: Scene,
  target: WebGLRenderTarget,
  width: number,
  height: number,
): void {
  const before = renderer.getRenderTarget();
  const { enabled } = renderer.xr;
  renderer.xr.enabled = false;
  target.setSize(width, height);
  target.viewport.set(0, 0, width, height);
  renderer.setRenderTarget(target);
  renderer.render(scene, ANY_CAMERA);
  renderer.setRenderTarget(before);
  renderer.xr.enabled = enabled;
}

/** The text of shaders, their chunks put in. */

import composite from "./composite.frag.glsl?raw";
import triangle from "./composite.vert.glsl?raw";
import { includeChunks } from "./include";
import fragment from "./raymarch.frag.glsl?raw";
import vertex from "./raymarch.vert.glsl?raw";
import trace from "./trace.frag.glsl?raw";
import denoise from "./trace_denoise.frag.glsl?raw";
import mean from "./trace_mean.frag.glsl?raw";
import noise from "./trace_noise.frag.glsl?raw";
import show from "./trace_show.frag.glsl?raw";

const files: Record<string, string> = import.meta.glob("./chunks/*.glsl", {
  query: "?raw",
  import: "default",
  eager: true,
});
export const CHUNKS = Object.fromEntries(
  Object.entries(files).map(([path, text]) => [path.slice(2, -".glsl".length), text]),
);

export const RAYMARCH_VERTEX = includeChunks(vertex, CHUNKS);
export const RAYMARCH_FRAGMENT = includeChunks(fragment, CHUNKS);
export const TRACE_FRAGMENT = includeChunks(trace, CHUNKS);
export const TRACE_NOISE = noise;
export const TRACE_MEAN = mean;
export const TRACE_DENOISE = denoise;
export const TRACE_SHOW = includeChunks(show, CHUNKS);
export const COMPOSITE_VERTEX = triangle;
export const COMPOSITE_FRAGMENT = composite;

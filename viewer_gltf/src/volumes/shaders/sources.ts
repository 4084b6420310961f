/** The text of shaders, their chunks put in. */

import { includeChunks } from "../../gpu/glsl_include";
import composite from "../../gpu/shaders/composite.frag.glsl?raw";
import triangle from "../../gpu/shaders/fullscreen_triangle.vert.glsl?raw";
import fragment from "./raymarch.frag.glsl?raw";
import vertex from "./raymarch.vert.glsl?raw";

const files: Record<string, string> = import.meta.glob("../../gpu/chunks/*.glsl", {
  query: "?raw",
  import: "default",
  eager: true,
});
export const CHUNKS = Object.fromEntries(
  Object.entries(files).map(([path, text]) => [
    path.slice("../../gpu/".length, -".glsl".length),
    text,
  ]),
);

export const RAYMARCH_VERTEX = includeChunks(vertex, CHUNKS);
export const RAYMARCH_FRAGMENT = includeChunks(fragment, CHUNKS);
export const COMPOSITE_VERTEX = triangle;
export const COMPOSITE_FRAGMENT = composite;

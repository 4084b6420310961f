/** The volume shader's text, its chunks put in. */
import { includeChunks } from "./include";
import fragment from "./raymarch.frag.glsl?raw";
import vertex from "./raymarch.vert.glsl?raw";

const files: Record<string, string> = import.meta.glob("./chunks/*.glsl", {
  query: "?raw",
  import: "default",
  eager: true,
});
const chunks = Object.fromEntries(
  Object.entries(files).map(([path, text]) => [path.slice(2, -".glsl".length), text]),
);

export const RAYMARCH_VERTEX = includeChunks(vertex, chunks);
export const RAYMARCH_FRAGMENT = includeChunks(fragment, chunks);

/** The text of the ray march with its chunks included. */
import { CHUNKS } from "../../gpu/glsl_chunks";
import { includeChunks } from "../../gpu/glsl_include";
import fragment from "./raymarch.frag.glsl?raw";
import vertex from "./raymarch.vert.glsl?raw";

export const RAYMARCH_VERTEX = includeChunks(vertex, CHUNKS);
export const RAYMARCH_FRAGMENT = includeChunks(fragment, CHUNKS);

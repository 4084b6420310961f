/**
 * The text of the shaders of the flat screen's background, in a part of the page that is loaded
 * later.
 */
import { CHUNKS } from "../glsl_chunks";
import { includeChunks } from "../glsl_include";
import backdrop from "./backdrop.frag.glsl?raw";
import rays from "./backdrop.vert.glsl?raw";

export const BACKDROP_VERTEX = rays;
export const BACKDROP_FRAGMENT = includeChunks(backdrop, CHUNKS);

/** The text of the shaders that composite images and encode the frame for the screen. */
import { CHUNKS } from "../glsl_chunks";
import { includeChunks } from "../glsl_include";
import composite from "./composite.frag.glsl?raw";
import copy from "./copy.frag.glsl?raw";
import encode from "./encode.frag.glsl?raw";
import fill from "./fill.frag.glsl?raw";
import triangle from "./fullscreen_triangle.vert.glsl?raw";
import keep from "./keep.frag.glsl?raw";

export const COMPOSITE_VERTEX = triangle;
export const COMPOSITE_FRAGMENT = includeChunks(composite, CHUNKS);
export const COPY_FRAGMENT = copy;
export const ENCODE_FRAGMENT = includeChunks(encode, CHUNKS);
export const FILL_FRAGMENT = includeChunks(fill, CHUNKS);
export const KEEP_FRAGMENT = keep;

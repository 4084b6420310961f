/** The text of the shaders that lay one picture over another. */
import composite from "./composite.frag.glsl?raw";
import triangle from "./fullscreen_triangle.vert.glsl?raw";

export const COMPOSITE_VERTEX = triangle;
export const COMPOSITE_FRAGMENT = composite;

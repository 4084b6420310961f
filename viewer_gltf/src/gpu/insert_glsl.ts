/**
 * Inserts pieces of GLSL into a shader of another library, such as three.js's materials. A .glsl
 * file has the pieces, each under a line that declares its place:
 *
 *   #insert start                 before the whole shader
 *   #insert main_start            at the start of `main`
 *   #insert main_end              at the end of `main`
 *   #insert before <chunk>        before a line `#include <chunk>` of the shader
 *   #insert after <chunk>         after that line
 *
 * Lines before the first `#insert` are comments.
 */

export type Insertion = Readonly<{ place: string; text: string }>;

const DECLARED = /^[ \t]*#insert (.+)$/m;
const MAIN_START = "void main() {";

export function insertionsOf(file: string): readonly Insertion[] {
  const [, ...parts] = file.split(DECLARED);
  const pairs = Array.from({ length: parts.length / 2 }, (_, i) => parts.slice(2 * i, 2 * i + 2));
  return pairs.map(([place, text]) => ({ place: place.trim(), text: `${text.trim()}\n` }));
}

/**
 * Returns the shader with all pieces inserted. Throws Error if the shader lacks the place of a
 * piece.
 */
export function insertInto(shader: string, insertions: readonly Insertion[]): string {
  return insertions.reduce((source, { place, text }) => insert(source, place, text), shader);
}

function insert(source: string, place: string, text: string): string {
  if (place === "start") return text + source;
  const [at, length] = placeIn(source, place);
  if (at === -1) throw new Error(`a shader has no place "${place}" to insert GLSL`);
  const isBefore = place === "main_end" || place.startsWith("before ");
  const cut = isBefore ? at : at + length;
  return `${source.slice(0, cut)}\n${text}${source.slice(cut)}`;
}

/** Where the text that marks a place begins, and how long it is. */
function placeIn(source: string, place: string): readonly [at: number, length: number] {
  if (place === "main_start") return [source.indexOf(MAIN_START), MAIN_START.length];
  if (place === "main_end") return [source.lastIndexOf("}"), 1];
  const landmark = `#include ${place.replace(/^(before|after) /, "")}`;
  return [source.indexOf(landmark), landmark.length];
}

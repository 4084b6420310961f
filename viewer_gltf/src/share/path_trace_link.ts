/**
 * Writes and reads the settings of path tracing in a link: `light=bias:0.1,lamp-0/x:1,...` A link contains only
 * differences from the opening state. Pure.
 */
import type { SetAction } from "../state/parameters/kinds";
import { LIGHT } from "../state/parameters/light";
import type { ViewerState } from "../state/viewer_state";
import { readWord, type SwitchWords, writeWords } from "./parameter_words";

const WORDS: SwitchWords = ["false", "true"];

export function writeLight(state: ViewerState, start: ViewerState): string {
  return writeWords(LIGHT, state, start, WORDS)
    .map(([name, word]) => `${name}:${word}`)
    .join(",");
}

/** Returns the action for each of a link's words; null for a word that can't be read. */
export function readLight(text: string): readonly (SetAction | null)[] {
  return text.split(",").map((part) => {
    const at = part.indexOf(":");
    const row = LIGHT.find(({ link }) => link === part.slice(0, Math.max(0, at)));
    return row === undefined ? null : readWord(row, part.slice(at + 1), WORDS);
  });
}

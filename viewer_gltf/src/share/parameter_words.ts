/** Converts parameters to words of a link, and back. Pure. */
import { fromHex, toHex } from "../math/color";
import { type Parameter, type SetAction, setTo, type Value } from "../state/parameters/kinds";
import { readNumbers, written } from "./numbers";

/** The words for a switch that is off, and for one that is on. */
export type SwitchWords = readonly [off: string, on: string];

function wordOf<On>(row: Parameter<On>, on: On, words: SwitchWords): string {
  switch (row.kind) {
    case "number":
      return written([row.get(on)]);
    case "switch":
      return words[row.get(on) ? 1 : 0];
    case "choice":
      return row.get(on);
    case "colour":
      return toHex(row.get(on)).slice(1);
  }
}

/** Returns the value that a word stands for; null if there is none. */
function valueIn<On>(row: Parameter<On>, word: string, words: SwitchWords): Value | null {
  switch (row.kind) {
    case "number":
      return readNumbers(word, 1)?.[0] ?? null;
    case "switch":
      return words.includes(word) ? word === words[1] : null;
    case "choice":
      return row.values.find((each) => each === word && each !== row.ownValue) ?? null;
    case "colour":
      return /^[0-9a-f]{6}$/i.test(word) ? fromHex(`#${word}`) : null;
  }
}

function isSame<On>(row: Parameter<On>, a: On, b: On): boolean {
  if (row.kind === "colour") return toHex(row.get(a)) === toHex(row.get(b));
  return row.get(a) === row.get(b);
}

/** Returns names and words of the parameters that differ from the opening state. Some always stay with the user. */
export function writeWords<On>(
  rows: readonly Parameter<On>[],
  on: On,
  start: On,
  words: SwitchWords,
): readonly (readonly [name: string, word: string])[] {
  return rows.flatMap((row) => {
    const isOwn = row.kind === "choice" && row.get(on) === row.ownValue;
    if (row.link === undefined || isOwn || isSame(row, on, start)) return [];
    return [[row.link, wordOf(row, on, words)] as const];
  });
}

/** Returns the action that a word stands for; null if the word can't be read. */
export function readWord<On>(
  row: Parameter<On>,
  word: string,
  words: SwitchWords,
  channel?: string,
): SetAction | null {
  const value = valueIn(row, word, words);
  return value === null ? null : setTo<Value>(row, value, channel);
}

/**
 * The path-traced picture's settings in a link: `light=bias:0.1,lamp-0/x:1,...` Only what differs
 * from what a bundle opens with. Pure.
 */
import { fromHex, toHex } from "../math/color";
import type { Action } from "../state/actions";
import { DIALS } from "../state/path_trace_parameters";
import { LAMPS, START_TRACE, TONE_MAPS, type TraceSettings } from "../state/path_trace_settings";
import { readNumbers, written } from "./numbers";

/** Light of the user's own file stays with the user. */
const ROOMS = ["studio", "sky"] as const;

export function writeTrace(trace: TraceSettings): string {
  const parts: string[] = [];
  for (const dial of DIALS) {
    const value = dial.of(trace);
    if (value !== dial.of(START_TRACE)) parts.push(`${dial.id}:${written([value])}`);
  }
  const words: readonly (readonly [string, string, string])[] = [
    ["room", trace.environment, START_TRACE.environment],
    ["tone", trace.toneMap, START_TRACE.toneMap],
    ["many", String(trace.isMultiple), String(START_TRACE.isMultiple)],
    ["after", String(trace.isPostOn), String(START_TRACE.isPostOn)],
    ...trace.lamps.flatMap(({ isOn, color }, i) => [
      [`lamp-${i}`, String(isOn), String(START_TRACE.lamps[i].isOn)] as const,
      [`lamp-${i}/color`, toHex(color), toHex(START_TRACE.lamps[i].color)] as const,
    ]),
  ];
  for (const [name, word, start] of words) {
    if (word !== start && word !== "own") parts.push(`${name}:${word.replace("#", "")}`);
  }
  return parts.join(",");
}

/** The actions that a link's words ask for; null: they can't be read. */
export function readTrace(text: string): readonly (Action | null)[] {
  return text.split(",").map((part) => {
    const at = part.indexOf(":");
    return at === -1 ? null : actionOf(part.slice(0, at), part.slice(at + 1));
  });
}

function actionOf(name: string, word: string): Action | null {
  const dial = DIALS.find(({ id }) => id === name);
  if (dial !== undefined) {
    const [value] = readNumbers(word, 1) ?? [];
    return value === undefined ? null : dial.to(value);
  }
  const room = ROOMS.find((each) => each === word);
  const toneMap = TONE_MAPS.find((each) => each === word);
  const isOn = word === "true" ? true : word === "false" ? false : null;
  if (name === "room") return room ? { type: "trace", change: { environment: room } } : null;
  if (name === "tone") return toneMap ? { type: "trace", change: { toneMap } } : null;
  if (name === "many" && isOn !== null) return { type: "trace", change: { isMultiple: isOn } };
  if (name === "after" && isOn !== null) return { type: "trace", change: { isPostOn: isOn } };
  const [, index, part] = /^lamp-(\d)(\/color)?$/.exec(name) ?? [];
  const lamp = Number(index);
  if (index === undefined || lamp >= LAMPS) return null;
  if (part !== undefined) {
    return /^[0-9a-f]{6}$/.test(word)
      ? { type: "move-lamp", lamp, change: { color: fromHex(`#${word}`) } }
      : null;
  }
  return isOn === null ? null : { type: "move-lamp", lamp, change: { isOn } };
}

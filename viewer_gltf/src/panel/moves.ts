/**
 * The page by which a head and one button move the specimen: each button goes on while it is held or
 * gazed at. Words are of the specimen, which is what moves in a room; commands are of the eye. Pure.
 */
import type { Command } from "../state/commands";
import type { Button } from "./controls";

function move(id: string, label: string, name: string, to: Command): Button {
  return { kind: "button", id, label, name, repeats: to, to: () => to };
}

/** In pairs of opposites: two of them share a row. */
export const MOVES: readonly Button[] = [
  move("nearer", "Nearer", "Bring it nearer", "zoom-in"),
  move("farther", "Farther", "Bring it farther away", "zoom-out"),
  move("roll-left", "◂ Turn", "Turn its front to the left", "turn-right"),
  move("roll-right", "Turn ▸", "Turn its front to the right", "turn-left"),
  move("roll-up", "▴ Turn", "Turn its front up", "turn-down"),
  move("roll-down", "Turn ▾", "Turn its front down", "turn-up"),
  move("shift-left", "◂ Move", "Move it to the left", "pan-right"),
  move("shift-right", "Move ▸", "Move it to the right", "pan-left"),
  move("shift-up", "▴ Move", "Move it up", "pan-down"),
  move("shift-down", "Move ▾", "Move it down", "pan-up"),
];

/**
 * The page on which a head and one button move the specimen. Each button repeats while it is held
 * or gazed at. The labels name the motion of the specimen, which moves in stereo; the commands name
 * the opposite motion of the eye. Pure.
 */
import type { Command } from "../state/commands";
import type { Button } from "./controls";

function move(id: string, label: string, name: string, to: Command): Button {
  return { kind: "button", id, label, name, repeats: to, to: () => to };
}

/**
 * Buttons that move the specimen. Two buttons in succession are opposite motions, and share a row.
 */
export const MOVES: readonly Button[] = [
  move("nearer", "Nearer", "Move the specimen closer", "zoom-in"),
  move("farther", "Farther", "Move the specimen farther away", "zoom-out"),
  move("roll-left", "◂ Turn", "Turn the front of the specimen to the left", "turn-right"),
  move("roll-right", "Turn ▸", "Turn the front of the specimen to the right", "turn-left"),
  move("roll-up", "▴ Turn", "Turn the front of the specimen up", "turn-down"),
  move("roll-down", "Turn ▾", "Turn the front of the specimen down", "turn-up"),
  move("shift-left", "◂ Move", "Move the specimen to the left", "pan-right"),
  move("shift-right", "Move ▸", "Move the specimen to the right", "pan-left"),
  move("shift-up", "▴ Move", "Move the specimen up", "pan-down"),
  move("shift-down", "Move ▾", "Move the specimen down", "pan-up"),
];

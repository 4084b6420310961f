/** The controls that have an explanation, by the last part of their IDs: the explanations come when asked for. Pure. */
const IDS =
  "mode switch-distance disc-radius compositing depth-shading volume transfer-function opacity window tool " +
  "measure-kind quality dwell eye-distance stereo-strength specimen-size letters";

export const EXPLAINED: readonly string[] = IDS.split(" ");

export function isExplained(id: string): boolean {
  return EXPLAINED.includes(id.slice(id.lastIndexOf("/") + 1));
}

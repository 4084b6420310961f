/**
 * The parts of the viewer, one line each. Without its line and its folder, a part is removed, and
 * the others still work. Only the folder of `share` has to stay, because the page reads its address
 * with it.
 */
export { additions } from "../additions/part";
export { annotations } from "../annotations/part";
export { bench } from "../bench/part";
export { capture } from "../capture/part";
export { channels } from "../channels/part";
export { messages } from "../messages/part";
export { notebook } from "../notebook/part";
export { objects } from "../objects/part";
export { offline } from "../offline/part";
export { page } from "../page/part";
export { pathTrace } from "../pathtrace/part";
export { share } from "../share/part";
export { slices } from "../slices/part";
export { stereo } from "../stereo/part";
export { surfaces } from "../surfaces/part";
export { tapCard } from "../tap_card/part";
export { tiles } from "../tiles/part";
export { volumes } from "../volumes/part";

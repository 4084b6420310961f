/**
 * The parts of the viewer, a line each. Without its line, and its folder, a part is gone and the others still work. Only
 * the folder of `share` has to stay, since the page opens by it what its address asks for.
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

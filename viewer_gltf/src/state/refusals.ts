/**
 * Reasons why a request has no effect now. Each sentence names what is missing and what to do. The
 * panel, the keys and the buttons use the same table. Pure.
 */

const MODES = "under Surfaces and volumes";

export const REFUSED = {
  tile: "No tile is selected, and none is in the middle of the view: select one under Tiles.",
  tileAhead: "No tile is in the middle of the view.",
  back: "No tile is selected, so there is nothing to go back from.",
  near: `This mode shows volumes at every distance, or none: choose a focus disc or one tile ${MODES}.`,
  disc: `This mode has no focus disc: choose “Focus disc of volume” ${MODES}.`,
  marched: `This mode draws no translucent volumes: choose “Volumes everywhere” ${MODES}.`,
  shaded: `Volumes beside surfaces have no depth shading: choose “Volumes everywhere” ${MODES}.`,
  opacity: "Depth shading needs the projection Opacity: choose it above.",
  tracing: `Path tracing is on: choose another mode ${MODES} to end it.`,
  transfer: "This channel is drawn as a surface: switch its volume on for transfer functions.",
  transferless: "This channel has no transfer function.",
  measuring: "A tap selects now: choose Measure first.",
  measured: "Nothing is measured yet: choose Measure (p), then two points.",
  points: "The measurement needs more points: choose them first.",
  cut: "Nothing is cut yet: cut with a box (b) or a plane (n).",
  views: "No view is kept yet: keep this one (').",
  objects: "No object is selected: select some first.",
  channel: "No channel is shown: switch one on under Channels.",
  page: "All channels fit on one page.",
  notice: "There is no notice to dismiss.",
  failed: "Nothing has failed to load.",
  shape: "There is no shape yet: add a rectangle (Q) or a triangle (Y).",
  volumes: "This bundle has only objects, and no volumes.",
  undo: "There is nothing to undo.",
  redo: "There is nothing to redo.",
  key: "This key changes nothing now.",
} as const;

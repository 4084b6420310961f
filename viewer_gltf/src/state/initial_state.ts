/** The state in which a bundle opens. Pure. */
import type { Manifest } from "../bundle/generated/bundle";
import type { ClipPlane } from "../math/clip";
import { START_CHANNEL } from "./parameters/channel";
import { START_SETTINGS } from "./parameters/settings";
import type { Mode } from "./parameters/volumes";
import { startOfParts } from "./part_settings";
import { traceLitBy } from "./stage_light";
import { MAX_CHANNELS, type ViewerState } from "./viewer_state";

/** Most tiles that open as volumes; of a larger specimen the chosen tile does. */
export const VOLUME_TILES_AT_START = 16;
/** DICOM's terms for scans of whole bodies, which are best seen as light passes through them. */
const TRACED_MODALITIES: readonly string[] = ["MR", "CT"];
/** Terms for PET and SPECT, whose volume shows heat. A surface has one colour, and would hide it. */
const TRACER_MODALITIES: readonly string[] = ["PT", "NM"];

/** The tiles, by the distance of their centres from the specimen's, nearest first. */
function fromTheMiddle({ specimen, tiles }: Manifest): Manifest["tiles"][number][] {
  const centerOf = ({ min, max }: Manifest["specimen"]["bounds_um"]) =>
    min.map((v, i) => (v + max[i]) / 2);
  const center = centerOf(specimen.bounds_um);
  const distance = (tile: Manifest["tiles"][number]) =>
    Math.hypot(...centerOf(tile.bounds_um).map((v, i) => v - center[i]));
  return [...tiles].sort((a, b) => distance(a) - distance(b));
}

/**
 * The state in which a bundle opens: the channels that the stage shows, as surfaces from afar and as volumes in the disc
 * when near; in the tiles that the stage draws as volumes, as those.
 */
export function initialState(manifest: Manifest, canTrace = true): ViewerState {
  const ordered = fromTheMiddle(manifest);
  const staged = ordered.filter((tile) => tile.representation !== "mesh");
  const asStaged = new Set(staged.slice(0, VOLUME_TILES_AT_START));
  const opened = manifest.channels.filter(({ opens }) => opens !== false).slice(0, MAX_CHANNELS);
  const shown = new Set(opened.map(({ id }) => id));
  return {
    ...START_SETTINGS,
    ...startOfParts(),
    trace: traceLitBy(manifest.lights, manifest.specimen.bounds_um),
    hasStageRoom: manifest.lights?.room !== undefined,
    channels: manifest.channels.map((channel, index) => ({
      id: channel.id,
      name: channel.name,
      shown: shown.has(channel.id),
      turn: index - manifest.channels.length, // before all that is shown later
      ...START_CHANNEL,
      color: channel.color,
      original: channel.color,
      window: [0, 1],
      transferFunction: channel.transfer_function,
      transferFunctions: channel.transfer_functions,
      transferFunctions2d: channel.transfer_functions_2d.names,
      transfer2d: null,
      shapes: {},
      hasSurface: channel.tileset !== null,
      hasObjects: channel.objects !== undefined,
      volume: START_CHANNEL.volume && channel.objects === undefined,
      surfaceReason: channel.surface_reason,
    })),
    tiles: manifest.tiles.map((tile) => ({
      id: tile.id,
      ...(tile.name === undefined ? {} : { name: tile.name }),
      representation: asStaged.has(tile) ? tile.representation : "mesh",
      ...(tile.unfinished ? { isUnfinished: true } : {}),
    })),
    middle: ordered[0].id,
    objects: {},
    mode: startMode(manifest, canTrace, staged.length > 0),
    selected: null,
    isolated: null,
    clip: { box: null, plane: openingPlane(manifest) },
    measured: [],
    measuredAs: "distance",
    measurements: [],
    keptViews: [],
    canTrace,
    notices:
      staged.length > VOLUME_TILES_AT_START
        ? [
            `The stage draws ${staged.length} tiles as volumes: ` +
              `the ${VOLUME_TILES_AT_START} in the middle are, "All" draws the rest.`,
          ]
        : [],
    mendable: [],
  };
}

/** The plane that the stage cuts the specimen open by. */
function openingPlane({ specimen: { cut } }: Manifest): ClipPlane | null {
  if (cut === undefined) return null;
  const [x, y, z] = cut.normal;
  return { normal: [x, y, z], offset_um: cut.offset_um };
}

/** Scans of bodies open by paths of light, tracers as volumes; an artist's choice goes before the disc. */
function startMode({ specimen }: Manifest, canTrace: boolean, isStaged: boolean): Mode {
  if (TRACED_MODALITIES.includes(specimen.modality)) return canTrace ? "traced" : "all";
  if (isStaged) return "stage";
  return TRACER_MODALITIES.includes(specimen.modality) ? "all" : "disc";
}

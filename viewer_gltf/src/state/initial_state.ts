/** The state in which a bundle opens. Pure. */
import type { Manifest } from "../bundle/generated/bundle";
import type { ClipPlane } from "../math/clip";
import { START_CHANNEL } from "./parameters/channel";
import { START_SETTINGS } from "./parameters/settings";
import type { Mode } from "./parameters/volumes";
import { startOfParts } from "./part_settings";
import { traceLitBy } from "./stage_light";
import { MAX_CHANNELS, type ViewerState } from "./viewer_state";

/**
 * Largest number of tiles that open as volumes. In a larger specimen, only the selected tile does.
 */
export const VOLUME_TILES_AT_START = 16;
/** DICOM modalities of scans of the body, which are best seen by path tracing. */
const TRACED_MODALITIES: readonly string[] = ["MR", "CT"];
/**
 * DICOM modalities of PET and SPECT. Their volumes show uptake; a surface of one colour would hide
 * it.
 */
const TRACER_MODALITIES: readonly string[] = ["PT", "NM"];

/** Returns the tiles, ordered by the distance of their centres from the specimen's centre. */
function byDistanceFromCentre({ specimen, tiles }: Manifest): Manifest["tiles"][number][] {
  const centerOf = ({ min, max }: Manifest["specimen"]["bounds_um"]) =>
    min.map((v, i) => (v + max[i]) / 2);
  const center = centerOf(specimen.bounds_um);
  const distance = (tile: Manifest["tiles"][number]) =>
    Math.hypot(...centerOf(tile.bounds_um).map((v, i) => v - center[i]));
  return [...tiles].sort((a, b) => distance(a) - distance(b));
}

/**
 * Returns the state in which a bundle opens. It shows the channels that the stage shows, as
 * surfaces from afar and as volumes in the disc when near. Tiles that the stage draws as volumes
 * open as volumes.
 */
export function initialState(manifest: Manifest, canTrace = true): ViewerState {
  const ordered = byDistanceFromCentre(manifest);
  const staged = ordered.filter((tile) => tile.representation !== "mesh");
  const asStaged = new Set(staged.slice(0, VOLUME_TILES_AT_START));
  const opened = manifest.channels.filter(({ opens }) => opens !== false).slice(0, MAX_CHANNELS);
  const shown = new Set(opened.map(({ id }) => id));
  return {
    ...START_SETTINGS,
    ...startOfParts(),
    trace: traceLitBy(manifest.lights, manifest.specimen.bounds_um),
    hasStageEnvironment: manifest.lights?.room !== undefined,
    channels: manifest.channels.map((channel, index) => ({
      id: channel.id,
      name: channel.name,
      shown: shown.has(channel.id),
      // negative: if too many channels are shown, these are hidden before any that the user has
      // shown
      turn: index - manifest.channels.length,
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
            `The stage draws ${staged.length} tiles as volumes, but only the ${VOLUME_TILES_AT_START} ` +
              "nearest to the centre open as volumes. Choose “Volumes everywhere” to draw the rest.",
          ]
        : [],
    retryable: [],
  };
}

/** Returns the clip plane of the stage. */
function openingPlane({ specimen: { cut } }: Manifest): ClipPlane | null {
  if (cut === undefined) return null;
  const [x, y, z] = cut.normal;
  return { normal: [x, y, z], offset_um: cut.offset_um };
}

/**
 * Returns the opening mode: path tracing for CT and MR, the choice of the stage, volumes for PET
 * and SPECT, else the disc.
 */
function startMode({ specimen }: Manifest, canTrace: boolean, hasStagedVolumes: boolean): Mode {
  if (TRACED_MODALITIES.includes(specimen.modality)) return canTrace ? "traced" : "all";
  if (hasStagedVolumes) return "stage";
  return TRACER_MODALITIES.includes(specimen.modality) ? "all" : "disc";
}

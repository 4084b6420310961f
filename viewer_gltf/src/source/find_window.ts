/**
 * Finds the window of a channel (the values that become 0 and 255), and counts the voxels within it.
 *
 * Follows `find_statistics` of pipeline/stereocell/transfer/channel_statistics.py with the percentiles of the presets. Two
 * things differ: values are sampled more sparsely (see coarse_volume.ts), and a head holder is not left out.
 */
export type Window = readonly [number, number];

export const BINS = 256;

/** Percent of the voxels that become 0, and percent that stay below 255. */
type Percentiles = readonly [number, number];
const DEFAULT: Percentiles = [0.5, 99.95];
const OF_LIGHT_SHEETS: Percentiles = [1, 99.9]; // presets/lightsheet.toml
const OF_MR: Percentiles = [1, 99.8]; // presets/mri.toml
/** Hounsfield units: presets/ct.toml. */
const OF_CT: Window = [-1024, 2000];

/** Voxel spacings of light-sheet volumes, um: above the first number, up to the second. See preset_choice.py. */
const OVERVIEW_UM = [1, 10];
/** Smallest voxel spacing of a scan of a body, um; microscopes have smaller ones. */
const BODY_UM = 100;
/** Smallest voxel spacing of a patient's MR, um. */
const PATIENT_UM = 300;
/** Smallest extent of a patient, um. */
const PART_UM = 20_000;

/** The kind of a volume: its DICOM modality (empty for a microscope), and its window or how to find it. */
export type Kind = Readonly<{ modality: "" | "CT" | "MR"; window: Window | Percentiles }>;

/** At least AIR_SHARE of a CT's voxels lie within AIR_SPREAD of air, HU, and 99 % lie below metal. */
const [AIR_HU, AIR_SPREAD, AIR_SHARE, MAX_HU] = [-1000, 150, 0.02, 4000];

/**
 * Returns the kind of a volume that states none, as `choose_preset` and `recognise_modality` of the pipeline choose it.
 * PET and SPECT, which the pipeline may recognise by the name of a file, are not recognised here.
 *
 * @param sample values of the first channel, sorted
 */
export function kindOf(
  sample: Float32Array,
  spacing_um: readonly number[],
  shape: readonly number[],
  { isSigned, channels }: Readonly<{ isSigned: boolean; channels: readonly unknown[] }>,
): Kind {
  const finest = Math.min(...spacing_um);
  if (isSigned && channels.length === 1 && hasAir(sample)) return { modality: "CT", window: OF_CT };
  if (finest < BODY_UM) {
    const isOverview = OVERVIEW_UM[0] < finest && finest <= OVERVIEW_UM[1];
    return { modality: "", window: isOverview ? OF_LIGHT_SHEETS : DEFAULT };
  }
  const across = Math.max(...shape.map((n, i) => n * spacing_um[i]));
  if (across < PART_UM || finest < PATIENT_UM) return { modality: "", window: DEFAULT };
  return { modality: "MR", window: OF_MR };
}

function hasAir(sorted: Float32Array): boolean {
  const air = sorted.filter((value) => Math.abs(value - AIR_HU) <= AIR_SPREAD).length;
  return air >= AIR_SHARE * sorted.length && percentile(sorted, 99) <= MAX_HU;
}

/** Returns a percentile of sorted values, linear between neighbours like NumPy's default. */
export function percentile(sorted: Float32Array, percent: number): number {
  const at = (percent / 100) * (sorted.length - 1);
  const low = Math.floor(at);
  const high = Math.min(low + 1, sorted.length - 1);
  return sorted[low] + (at - low) * (sorted[high] - sorted[low]);
}

/** Returns the window between two percentiles. The window of a constant channel is 1 wide. */
export function findWindow(sorted: Float32Array, [low, high]: Percentiles): Window {
  const found = [percentile(sorted, low), percentile(sorted, high)] as const;
  if (found[1] > found[0]) return found;
  // The percentiles coincide in a sparse channel, whose bright voxels are fewer than the percentile leaves out.
  const ends = [sorted[0], sorted[sorted.length - 1]] as const;
  if (ends[1] > ends[0]) return ends;
  return [ends[0], ends[0] + Math.max(1, 1e-6 * Math.abs(ends[0]))]; // wider than the step between two float32 numbers
}

/** Voxel counts in BINS equal bins of the window; values outside count in the first or the last. */
export function histogramOf(values: Float32Array, [low, high]: Window): Float64Array {
  const counts = new Float64Array(BINS);
  const scale = BINS / (high - low);
  for (let i = 0; i < values.length; i++) {
    const bin = Math.floor((values[i] - low) * scale);
    counts[bin < 0 ? 0 : bin < BINS ? bin : BINS - 1]++;
  }
  return counts;
}

/** Returns the window for a kind of volume: a fixed one for CT, otherwise one found by percentiles. */
export function windowOf({ modality, window }: Kind, sorted: Float32Array): Window {
  return modality === "CT" ? window : findWindow(sorted, window);
}

/**
 * Keeps the time of a frame in its budget by reducing quality one notch at a time. Pure.
 *
 * Down: a window of frames over budget lowers the quality by a notch, or by several if far over.
 * Up: a notch is raised only if its price, measured when it was lowered, fits with a margin. A
 * steady load therefore settles. Prices are forgotten when the load has fallen. A single slow frame
 * does not change the interquartile mean of a window; a much longer stall is ignored.
 *
 * If only the time between frames is known, the display rounds it up, which hides the margin. The
 * next notch is then tried after some time in budget. Each failed trial doubles that time.
 */

export type QualitySettings = Readonly<{
  /** Largest number of steps along a ray. */
  steps: number;
  /** Pixels of the march along an edge of the frame, as a share of the frame's pixels. */
  resolution: number;
  /** Factor, 0..1, to the radius of the focus disc that the user has set. */
  discShare: number;
  /** Screen-space error of the meshes, as a multiple of the usual error. */
  errorFactor: number;
}>;

const HIGH: QualitySettings = { steps: 100, resolution: 1, discShare: 1, errorFactor: 1 };
const LOW: QualitySettings = { steps: 48, resolution: 0.5, discShare: 0.75, errorFactor: 2 };

/** Settings of each notch, best first. One setting after the other is reduced. */
export const NOTCHES: readonly QualitySettings[] = [
  HIGH,
  ...([80, 64, 50, 40, 32] as const).map((steps) => ({ ...HIGH, steps })),
  ...([0.75, 0.5, 1 / 3] as const).map((resolution) => ({ ...HIGH, steps: 32, resolution })),
  ...([0.93, 0.87, 0.81, 0.75] as const).map((discShare) => ({
    ...HIGH,
    steps: 32,
    resolution: 1 / 3,
    discShare,
  })),
  ...([1.4, 2, 2.8, 4] as const).map((errorFactor) => ({
    steps: 32,
    resolution: 1 / 3,
    discShare: 0.75,
    errorFactor,
  })),
];
const LAST_NOTCH = NOTCHES.length - 1;

export const QUALITY_LEVELS = ["auto", "low", "high"] as const;
export type QualityLevel = (typeof QUALITY_LEVELS)[number];
/** Whether frame_ms is the work of a frame (GPU timer) or the time since the previous frame. */
export type Timing = "work" | "interval";

export type Quality = Readonly<{
  level: QualityLevel;
  timing: Timing;
  /** Index into NOTCHES. */
  notch: number;
  /** Times of the frames in this notch that have not been judged yet. */
  window_ms: readonly number[];
  /** Frames to skip after a change, because the GPU's times arrive late. */
  pause: number;
  /** Number of consecutive stalls that were ignored. */
  stalls: number;
  /** Factor by which a frame gets slower one notch higher. Entry k is from k + 1 to k; 0: unknown. */
  prices: readonly number[];
  /** Longest window mean in this notch. A much shorter one means that the load has fallen. */
  usual_ms: number;
  /** Mean of the last judged window and its notch; 0: none since the last change. */
  before_ms: number;
  before_notch: number;
  /**
   * Frames in budget since the last change, and the number after which a notch is tried ("interval"
   * only).
   */
  calm: number;
  patience: number;
}>;

const WINDOW = 20;
/**
 * Slow frames are judged sooner: a window of SHORT_WINDOW frames is enough if they took
 * SHORT_WINDOW_MS together.
 */
const SHORT_WINDOW = 8;
const SHORT_WINDOW_MS = 400;
const PAUSE = 4;
/**
 * Factor to the mean of the window above which a frame is a stall. After SHORT_WINDOW stalls in a
 * row, the next is not one.
 */
const STALL_FACTOR = 4;
/**
 * Factor to the budget up to which a frame counts as in time. Intervals between frames vary with
 * the display.
 */
const TOLERANCE: Readonly<Record<Timing, number>> = { work: 1, interval: 1.15 };
/** Share of the budget that a frame must be expected to keep before a notch is raised. */
const MARGIN = 0.9;
/** Assumed price of a notch, as a factor to the frame's time, before it is measured. */
const USUAL_PRICE = 1.15;
/** Share of the usual time below which the load has fallen. */
const FALLEN_SHARE = 0.85;
/**
 * Quality is lowered by one notch if a frame takes the budget times this factor, by two notches if
 * it takes the budget times its square.
 */
const FACTOR_A_NOTCH = 1.25;
const MAX_NOTCHES = 6;
const PATIENCE = 90;
const MAX_PATIENCE = 5400;

export function initialQuality(timing: Timing, level: QualityLevel = "auto"): Quality {
  return {
    level,
    timing,
    notch: 0,
    window_ms: [],
    pause: PAUSE,
    stalls: 0,
    prices: NOTCHES.slice(1).map(() => 0),
    usual_ms: 0,
    before_ms: 0,
    before_notch: 0,
    calm: 0,
    patience: PATIENCE,
  };
}

/**
 * Sets the quality that the user has chosen: high, low or auto. "auto" begins again from full
 * quality.
 */
export function withLevel(quality: Quality, level: QualityLevel): Quality {
  return level === quality.level ? quality : initialQuality(quality.timing, level);
}

/** Returns the settings that the viewer draws with: the same object as long as nothing changes. */
export function qualitySettings({ level, notch }: Quality): QualitySettings {
  return level === "auto" ? NOTCHES[notch] : level === "low" ? LOW : HIGH;
}

/**
 * Returns the budget for a display's rate. If only the work is measured, 15 % is left for the
 * browser, which puts the frame on the screen.
 */
export function frameBudget_ms(rate_hz: number, timing: Timing): number {
  return (timing === "work" ? 0.85 : 1) * (1000 / rate_hz);
}

/**
 * Returns the quality after one more frame. Do not pass a frame that follows a pause: unchanged
 * scenes are not drawn, so the interval means nothing.
 */
export function advanceQuality(quality: Quality, frame_ms: number, budget_ms: number): Quality {
  if (quality.level !== "auto" || !(frame_ms > 0) || !Number.isFinite(frame_ms)) return quality;
  if (quality.pause > 0) return { ...quality, pause: quality.pause - 1 };
  if (isStall(quality, frame_ms)) return { ...quality, stalls: quality.stalls + 1 };

  // Stalls that persist are the load. The window before them no longer counts.
  const isNewLoad = quality.stalls >= SHORT_WINDOW;
  const window_ms = isNewLoad ? [frame_ms] : [...quality.window_ms, frame_ms];
  const usual_ms = isNewLoad ? 0 : quality.usual_ms;
  const sum_ms = window_ms.reduce((sum, ms) => sum + ms, 0);
  const isFull =
    window_ms.length >= WINDOW || (window_ms.length >= SHORT_WINDOW && sum_ms >= SHORT_WINDOW_MS);
  if (!isFull) return { ...quality, window_ms, usual_ms, stalls: 0 };
  const judged = {
    ...quality,
    window_ms: [],
    usual_ms,
    stalls: 0,
    calm: quality.calm + window_ms.length,
  };
  return judge(judged, middleMean(window_ms), budget_ms);
}

function isStall({ window_ms, usual_ms, stalls }: Quality, frame_ms: number): boolean {
  const usual = window_ms.length >= 3 ? middleMean(window_ms) : usual_ms;
  return stalls < SHORT_WINDOW && usual > 0 && frame_ms > STALL_FACTOR * usual;
}

/** Mean of the middle half. Stray frames do not change it, as with a median, but every third frame does. */
function middleMean(values: readonly number[]): number {
  const sorted = [...values].sort((a, b) => a - b);
  const cut = Math.floor(sorted.length / 4);
  const middle = sorted.slice(cut, sorted.length - cut);
  return middle.reduce((sum, v) => sum + v, 0) / middle.length;
}

function judge(quality: Quality, mean_ms: number, budget_ms: number): Quality {
  const known = withPrice(quality, mean_ms);
  const over = mean_ms / (budget_ms * TOLERANCE[known.timing]);
  if (over > 1 && isTrial(quality)) {
    const patience = Math.min(2 * known.patience, MAX_PATIENCE);
    return moveTo({ ...known, patience }, quality.before_notch, mean_ms);
  }
  if (over > 1)
    return moveTo(known, Math.min(known.notch + notchesFor(over, known), LAST_NOTCH), mean_ms);
  return known.timing === "work"
    ? judgeMargin(known, mean_ms, budget_ms)
    : judgeCalm(isTrial(quality) ? { ...known, patience: PATIENCE } : known, mean_ms);
}

/**
 * Returns the number of notches to lower. An interval may include nearly one budget that the
 * display added.
 */
function notchesFor(over: number, { timing }: Quality): number {
  const sure = timing === "interval" ? Math.max(1, over - 1) : over;
  const notches = Math.floor(Math.log(sure) / Math.log(FACTOR_A_NOTCH));
  return Math.min(Math.max(notches, 1), MAX_NOTCHES);
}

/** Returns whether the judged window is the first after a notch was raised, which may fail. */
function isTrial({ before_ms, before_notch, notch }: Quality): boolean {
  return before_ms > 0 && notch < before_notch;
}

/**
 * Learns the price of the notches between the previous and the present one, from the frames
 * that first follow a change.
 */
function withPrice(quality: Quality, mean_ms: number): Quality {
  const { before_ms, before_notch, notch } = quality;
  const settled = { ...quality, before_ms: 0, before_notch: notch };
  if (before_ms === 0 || before_notch === notch) return settled;
  const notches = Math.abs(before_notch - notch);
  const ratio = notch > before_notch ? before_ms / mean_ms : mean_ms / before_ms;
  const price = Math.max(1, ratio ** (1 / notches));
  const [from, to] = [Math.min(notch, before_notch), Math.max(notch, before_notch)];
  const prices = quality.prices.map((p, k) => (k >= from && k < to ? price : p));
  return { ...settled, prices };
}

function judgeMargin(quality: Quality, mean_ms: number, budget_ms: number): Quality {
  const hasFallen = mean_ms < FALLEN_SHARE * quality.usual_ms;
  const prices = hasFallen ? quality.prices.map(() => 0) : quality.prices;
  const usual_ms = hasFallen ? mean_ms : Math.max(quality.usual_ms, mean_ms);
  const settled = { ...quality, prices, usual_ms };
  if (settled.notch === 0) return settled;
  const price = prices[settled.notch - 1] || USUAL_PRICE;
  if (mean_ms * price >= MARGIN * budget_ms) return settled;
  return moveTo(settled, settled.notch - 1, mean_ms);
}

function judgeCalm(quality: Quality, mean_ms: number): Quality {
  const usual_ms = Math.max(quality.usual_ms, mean_ms);
  if (quality.notch === 0 || quality.calm < quality.patience) return { ...quality, usual_ms };
  return moveTo(quality, quality.notch - 1, mean_ms);
}

function moveTo(quality: Quality, notch: number, mean_ms: number): Quality {
  if (notch === quality.notch) return quality;
  return {
    ...quality,
    notch,
    pause: PAUSE,
    usual_ms: 0,
    before_ms: mean_ms,
    before_notch: quality.notch,
    calm: 0,
  };
}

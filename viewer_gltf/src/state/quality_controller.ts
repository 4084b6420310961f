/**
 * Keeps a frame's time in its budget by giving up quality one notch at a time. Pure.
 *
 * Down: a window of frames over budget gives up a notch, several if far over. Up: only if the
 * notch's price, which was measured when it was given up, fits with room to spare, so a steady
 * load settles and stays. Prices are forgotten once the load has fallen. A single slow frame moves
 * the interquartile mean of a window not at all; a stall far longer than its window is left out.
 *
 * Where only the time between frames is known, the display rounds it up and room does not show:
 * there the next notch is tried after a while in budget, and a try that fails doubles that while.
 */

export type QualitySettings = Readonly<{
  /** Most steps along a ray. */
  steps: number;
  /** Pixels of the march along an edge of the picture, as a share of the picture's. */
  resolution: number;
  /** Radius of the gaze's disc, as a share of what the user has set. */
  discShare: number;
  /** Screen-space error of the meshes, as a multiple of the usual. */
  errorFactor: number;
}>;

const HIGH: QualitySettings = { steps: 100, resolution: 1, discShare: 1, errorFactor: 1 };
const LOW: QualitySettings = { steps: 48, resolution: 0.5, discShare: 0.75, errorFactor: 2 };

/** Each notch's settings, best first: one thing after the other is given up. */
export const LADDER: readonly QualitySettings[] = [
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
const LAST = LADDER.length - 1;

export const QUALITY_LEVELS = ["auto", "low", "high"] as const;
export type QualityLevel = (typeof QUALITY_LEVELS)[number];
/** Whether frame_ms is what a frame cost (GPU timer) or the time since the frame before. */
export type Timing = "work" | "interval";

export type Quality = Readonly<{
  level: QualityLevel;
  timing: Timing;
  /** Index into LADDER. */
  notch: number;
  /** Frames of this notch that have not been judged yet. */
  window_ms: readonly number[];
  /** Frames still to pass after a change: the GPU's times come late. */
  pause: number;
  /** Stalls in a row that were left out. */
  stalls: number;
  /** By how much a frame costs more one notch higher; entry k is from k + 1 to k, 0: unknown. */
  prices: readonly number[];
  /** The longest window of this notch; much less than it means that the load has fallen. */
  usual_ms: number;
  /** The last judged window, and the notch at which it was; 0: none since the last jump. */
  before_ms: number;
  before_notch: number;
  /** Frames in budget since the last change, and how many make a try ("interval" only). */
  calm: number;
  patience: number;
}>;

const WINDOW = 20;
/** Slow frames are judged sooner: so many of them, if they took so long together. */
const SHORT_WINDOW = 8;
const SHORT_WINDOW_MS = 400;
const PAUSE = 4;
/** Length of a stall, in lengths of its window, unless SHORT_WINDOW such frames follow in a row. */
const STALL = 4;
/** Frame times above the budget that still keep it, as a factor: displays are unsteady. */
const TOLERANCE: Readonly<Record<Timing, number>> = { work: 1, interval: 1.15 };
/** Share of the budget within which a notch must be expected to stay before it is taken back. */
const ROOM = 0.9;
/** Cost of a notch before a measurement, as a factor to the frame's time. */
const USUAL_PRICE = 1.15;
/** Share of the usual time below which the load has fallen. */
const FALLEN = 0.85;
/** Factor over budget for which one notch is given up. */
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
    prices: LADDER.slice(1).map(() => 0),
    usual_ms: 0,
    before_ms: 0,
    before_notch: 0,
    calm: 0,
    patience: PATIENCE,
  };
}

/** A level fixed by the user holds until "auto" gives the choice back, from full quality on. */
export function withLevel(quality: Quality, level: QualityLevel): Quality {
  return level === quality.level ? quality : initialQuality(quality.timing, level);
}

/** The settings that the viewer draws with; the same object as long as nothing has changed. */
export function qualitySettings({ level, notch }: Quality): QualitySettings {
  return level === "auto" ? LADDER[notch] : level === "low" ? LOW : HIGH;
}

/**
 * The budget at a display's rate. Of the work, a part is left to the browser, which puts the
 * picture on the screen.
 */
export function frameBudget_ms(rate_hz: number, timing: Timing): number {
  return (timing === "work" ? 0.85 : 1) * (1000 / rate_hz);
}

/**
 * The quality after one more frame. Give it no frame that came after a rest (a picture that did not
 * change is not drawn): such an interval means nothing.
 */
export function advanceQuality(quality: Quality, frame_ms: number, budget_ms: number): Quality {
  if (quality.level !== "auto" || !(frame_ms > 0) || !Number.isFinite(frame_ms)) return quality;
  if (quality.pause > 0) return { ...quality, pause: quality.pause - 1 };
  if (isStall(quality, frame_ms)) return { ...quality, stalls: quality.stalls + 1 };

  // Stalls that do not end are the load: what was before them counts no more.
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
  return stalls < SHORT_WINDOW && usual > 0 && frame_ms > STALL * usual;
}

/** Mean of the middle half: blind to stray frames as a median is, but not to every third one. */
function middleMean(values: readonly number[]): number {
  const sorted = [...values].sort((a, b) => a - b);
  const cut = Math.floor(sorted.length / 4);
  const middle = sorted.slice(cut, sorted.length - cut);
  return middle.reduce((sum, v) => sum + v, 0) / middle.length;
}

function judge(quality: Quality, mean_ms: number, budget_ms: number): Quality {
  const known = withPrice(quality, mean_ms);
  const over = mean_ms / (budget_ms * TOLERANCE[known.timing]);
  if (over > 1 && isTry(quality)) {
    const patience = Math.min(2 * known.patience, MAX_PATIENCE);
    return moveTo({ ...known, patience }, quality.before_notch, mean_ms);
  }
  if (over > 1)
    return moveTo(known, Math.min(known.notch + notchesFor(over, known), LAST), mean_ms);
  return known.timing === "work"
    ? judgeRoom(known, mean_ms, budget_ms)
    : judgeCalm(isTry(quality) ? { ...known, patience: PATIENCE } : known, mean_ms);
}

/** How many notches to give up; of an interval the display may have added nearly one budget. */
function notchesFor(over: number, { timing }: Quality): number {
  const sure = timing === "interval" ? Math.max(1, over - 1) : over;
  const notches = Math.floor(Math.log(sure) / Math.log(FACTOR_A_NOTCH));
  return Math.min(Math.max(notches, 1), MAX_NOTCHES);
}

/** Whether the window that is judged is the first after a step up, which may fail. */
function isTry({ before_ms, before_notch, notch }: Quality): boolean {
  return before_ms > 0 && notch < before_notch;
}

/** Learn from the first window after a change what the notches in between cost. */
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

function judgeRoom(quality: Quality, mean_ms: number, budget_ms: number): Quality {
  const hasFallen = mean_ms < FALLEN * quality.usual_ms;
  const prices = hasFallen ? quality.prices.map(() => 0) : quality.prices;
  const usual_ms = hasFallen ? mean_ms : Math.max(quality.usual_ms, mean_ms);
  const settled = { ...quality, prices, usual_ms };
  if (settled.notch === 0) return settled;
  const price = prices[settled.notch - 1] || USUAL_PRICE;
  if (mean_ms * price >= ROOM * budget_ms) return settled;
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

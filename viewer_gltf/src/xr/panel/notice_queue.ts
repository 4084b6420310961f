/**
 * Queue of notices in stereo, where the page cannot be seen. A few texts lie under each other, the
 * newest last. The oldest disappears first.
 */
import { type Mark, type Rect, text } from "../../panel/canvas/draw_list";

/** Seconds that the oldest notice stays; then the next one stays as long. */
export const ANNOUNCED_S = 5;
const MAX_NOTICES = 3;

export type Announcements = Readonly<{
  texts: readonly string[];
  /** How long the first text has been the oldest, s. */
  elapsed_s: number;
}>;
export const NO_ANNOUNCEMENTS: Announcements = { texts: [], elapsed_s: 0 };

/** Adds a text at the end. A repeated text moves to the end. */
export function announce({ texts, elapsed_s }: Announcements, newest: string): Announcements {
  const others = texts.filter((each) => each !== newest).slice(1 - MAX_NOTICES);
  return { texts: [...others, newest], elapsed_s: others[0] === texts[0] ? elapsed_s : 0 };
}

/** Advances the time. Returns the same object if there are no notices. */
export function advanceAnnouncements(announcements: Announcements, dt_s: number): Announcements {
  const { texts } = announcements;
  if (texts.length === 0) return announcements;
  const elapsed_s = announcements.elapsed_s + dt_s;
  if (elapsed_s < ANNOUNCED_S) return { texts, elapsed_s };
  return texts.length === 1 ? NO_ANNOUNCEMENTS : { texts: texts.slice(1), elapsed_s: 0 };
}

/** Width of a notice, px: half of a Cardboard's field of view at 0.9 m. */
export const NOTICE_WIDTH = 1040;
const PAD = 16;
/**
 * Letter sizes, px; the largest that fits all texts is used, since small letters are illegible on
 * half a phone's screen.
 */
const SIZES = [80, 60, 48] as const;
const SMALLEST = SIZES[SIZES.length - 1];
const MAX_LINES = 4;
export const NOTICE_HEIGHT = MAX_NOTICES * (MAX_LINES * pitchOf(SMALLEST) + 3 * PAD);
export const NOTICE_PX_PER_M = 1600;

function pitchOf(size: number): number {
  return Math.ceil(1.15 * size);
}

/**
 * Number of lines, estimated: a letter is about half as wide as it is high, and lines break at
 * words.
 */
function linesOf(words: string, size: number): number {
  const letters = Math.floor((NOTICE_WIDTH - 4 * PAD) / (0.58 * size));
  return words.split("\n").reduce((sum, line) => sum + Math.ceil(line.length / letters), 0);
}

function sizeFor(texts: readonly string[]): number {
  const fits = (size: number) => {
    const lines = texts.map((words) => linesOf(words, size));
    const height = lines.reduce((sum, each) => sum + each * pitchOf(size) + 3 * PAD, 0);
    return height <= NOTICE_HEIGHT && Math.max(...lines) <= MAX_LINES;
  };
  return SIZES.find(fits) ?? SMALLEST;
}

/** Height of the texts, measured from the upper edge, px. */
export function textsHeight(texts: readonly string[]): number {
  const rects = noticeMarks(texts).map(({ rect }) => rect.y + rect.height);
  return Math.max(0, ...rects);
}

/** The marks of the texts from the top of the quad; the rest of the quad stays clear. */
export function noticeMarks(texts: readonly string[]): readonly Mark[] {
  const size = sizeFor(texts);
  let y = 0;
  return texts.flatMap((words): Mark[] => {
    const lines = Math.min(MAX_LINES, linesOf(words, size));
    const height = lines * pitchOf(size) + 2 * PAD;
    const rect: Rect = { x: 0, y, width: NOTICE_WIDTH, height };
    y += rect.height + PAD;
    return [
      { kind: "box", rect, fill: "back", stroke: "line", radius: PAD },
      text({ ...rect, x: PAD, width: NOTICE_WIDTH - 2 * PAD }, words, { lines, size }),
    ];
  });
}

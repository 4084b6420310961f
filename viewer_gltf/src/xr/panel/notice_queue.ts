/**
 * Notices before the eyes in stereo, where nobody sees the page: a few texts under each other,
 * the newest last. One after the other goes by itself. Pure.
 */
import { type Mark, type Rect, text } from "../../panel/canvas/draw_list";

/** Time for the oldest notice, s: then it goes, and the next one has as long. */
export const ANNOUNCED_S = 5;
const MAX_NOTICES = 3;

export type Announcements = Readonly<{
  texts: readonly string[];
  /** How long the oldest has been the oldest. */
  elapsed_s: number;
}>;
export const NO_ANNOUNCEMENTS: Announcements = { texts: [], elapsed_s: 0 };

/** A repeated text becomes the newest again. */
export function announce({ texts, elapsed_s }: Announcements, newest: string): Announcements {
  const others = texts.filter((each) => each !== newest).slice(1 - MAX_NOTICES);
  return { texts: [...others, newest], elapsed_s: others[0] === texts[0] ? elapsed_s : 0 };
}

/** Returns the same object while there is no notice. */
export function advanceAnnouncements(announcements: Announcements, dt_s: number): Announcements {
  const { texts } = announcements;
  if (texts.length === 0) return announcements;
  const elapsed_s = announcements.elapsed_s + dt_s;
  if (elapsed_s < ANNOUNCED_S) return { texts, elapsed_s };
  return texts.length === 1 ? NO_ANNOUNCEMENTS : { texts: texts.slice(1), elapsed_s: 0 };
}

/** Width of a notice, px: half of a Cardboard's field of view, 0.9 m away. */
export const NOTICE_WIDTH = 1040;
const PAD = 16;
/** Letters as large as all texts have room for, px: on a phone's half of a screen small ones can't be read. */
const SIZES = [80, 60, 48] as const;
const SMALLEST = SIZES[SIZES.length - 1];
const MAX_LINES = 4;
export const NOTICE_HEIGHT = MAX_NOTICES * (MAX_LINES * pitchOf(SMALLEST) + 3 * PAD);
export const NOTICE_PX_PER_M = 1600;

function pitchOf(size: number): number {
  return Math.ceil(1.15 * size);
}

/** A letter is about half as wide as it is high, and words break early. */
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

/** Height of the texts from the upper edge, px. */
export function textsHeight(texts: readonly string[]): number {
  const rects = noticeMarks(texts).map(({ rect }) => rect.y + rect.height);
  return Math.max(0, ...rects);
}

/** From the top of the plane; what is not covered stays clear. */
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

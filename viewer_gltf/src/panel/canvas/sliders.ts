/** Sliders of the panel on a canvas. Pure. */
import type { Request, Slider, Window } from "../controls";
import { type Block, GAP, type Mark, type Rect, ROW, SMALL, type Tone, text } from "./draw_list";
import { one, region, toneOf, unlessRefused } from "./parts";

/** Height of the text above a track, px. */
const WORDS = 50;
const KNOB = 44;
const LINE = 16;

type Track = Readonly<{
  id: string;
  label: string;
  value: number;
  text: string;
  steps: number;
  refusal?: string;
  to: (value: number) => Request;
}>;

/**
 * Draws a slider: its text in the upper half of the row, its track in the lower half. The user can
 * drag anywhere in the row.
 */
function track(slider: Track, row: Rect): Block {
  const words: Rect = { ...row, height: WORDS };
  const end = ROW / 2; // a knob at either end then stays in the region
  const length = row.width - 2 * end;
  const at = row.x + end + slider.value * length;
  const middle = row.y + (WORDS + ROW - GAP) / 2;
  const bar = (x: number, width: number, height: number, fill: Tone): Mark => {
    const rect = { x, y: middle - height / 2, width, height };
    return { kind: "box", rect, fill, stroke: null, radius: height / 2 };
  };
  const left = row.x + end;
  const tone = toneOf(slider);
  const marks: Mark[] = [
    text(words, slider.label, { tone, size: SMALL }),
    text(words, slider.text, { align: "right", size: SMALL, tone }),
    bar(left, length, LINE, "line"),
    bar(left, at - left, LINE, slider.refusal ? "line" : "accent"),
    bar(at - KNOB / 2, KNOB, KNOB, slider.refusal ? "dim" : "text"),
  ];
  const to = (across: number) => {
    const share = Math.min(1, Math.max(0, (across * row.width - end) / length));
    return slider.to(Math.round(share * slider.steps) / slider.steps);
  };
  return one(marks, unlessRefused(slider, [region(slider.id, slider.label, row, to, true)]));
}

export function sliderRow(slider: Slider, row: Rect): Block {
  return track(slider, row);
}

/** Draws one end of a window, which cannot pass the other end. */
export function windowRow(window: Window, end: 0 | 1, row: Rect): Block {
  const { id, label, value, texts, steps, refusal } = window;
  const other = value[1 - end];
  return track(
    {
      id: `${id}=${end === 0 ? "low" : "high"}`,
      label: `${label} ${end === 0 ? "from" : "to"}`,
      value: value[end],
      text: texts[end],
      steps,
      refusal,
      to: (v) => window.to(end === 0 ? [Math.min(v, other), other] : [other, Math.max(v, other)]),
    },
    row,
  );
}

/** Sliders of the panel on a canvas. Pure. */
import type { Slider, Window, Wish } from "../controls";
import { type Block, type Mark, type Rect, ROW, SMALL, text } from "./draw_list";
import { LABEL, one, region, toneOf, unlessRefused } from "./parts";

/** A slider's value, as a share of the row. */
const VALUE = 0.21;

type Track = Readonly<{
  id: string;
  label: string;
  value: number;
  text: string;
  steps: number;
  refusal?: string;
  to: (value: number) => Wish;
}>;

function track(slider: Track, row: Rect): Block {
  const [left, right] = [row.width * LABEL, row.width * VALUE];
  const label: Rect = { ...row, width: left };
  const value: Rect = { ...row, x: row.x + row.width - right, width: right };
  const whole: Rect = { ...row, x: row.x + left, width: row.width - left - right };
  const end = ROW / 2; // a knob at either end stays in the region
  const length = whole.width - 2 * end;
  const at = whole.x + end + slider.value * length;
  const line = (x: number, width: number): Rect => ({
    x,
    y: row.y + ROW / 2 - 7,
    width,
    height: 14,
  });
  const tone = slider.refusal ? "line" : "accent";
  const knob: Rect = { x: at - 18, y: row.y + ROW / 2 - 18, width: 36, height: 36 };
  const marks: Mark[] = [
    text(label, slider.label, { tone: toneOf(slider), size: SMALL + 2 }),
    { kind: "box", rect: line(whole.x + end, length), fill: "line", stroke: null, radius: 7 },
    {
      kind: "box",
      rect: line(whole.x + end, at - whole.x - end),
      fill: tone,
      stroke: null,
      radius: 7,
    },
    { kind: "box", rect: knob, fill: slider.refusal ? "dim" : "text", stroke: null, radius: 18 },
    text(value, slider.text, { align: "right", size: SMALL + 2, tone: toneOf(slider) }),
  ];
  const to = (across: number) => {
    const share = Math.min(1, Math.max(0, (across * whole.width - end) / length));
    return slider.to(Math.round(share * slider.steps) / slider.steps);
  };
  return one(marks, unlessRefused(slider, [region(slider.id, slider.label, whole, to, true)]));
}

export function sliderRow(slider: Slider, row: Rect): Block {
  return track(slider, row);
}

/** One end of a window: it never passes the other. */
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

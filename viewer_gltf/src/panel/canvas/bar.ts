/**
 * The bar below the specimen in stereo: the most frequent actions, each a target for one gaze.
 * While the menu is open, the bar has the buttons that lead between the menu's pages. *Undo* and
 * *Menu* keep their places. Pure.
 */
import { setTo } from "../../state/parameters/kinds";
import { MODE, type Mode } from "../../state/parameters/volumes";
import { hasVolumes, type ViewerState } from "../../state/viewer_state";
import { MOVES } from "../moves";
import { box, type CanvasRequest, type Mark, type Rect, type Region, text } from "./draw_list";
import type { Page } from "./page";

const SLOT: Rect = { x: 0, y: 0, width: 184, height: 92 };
const COLUMNS = 4;
const ROWS = 2;
/** Size of the texture, px; PX_PER_M of page.ts. */
export const BAR_WIDTH = COLUMNS * SLOT.width;
export const BAR_HEIGHT = ROWS * SLOT.height;

export type BarInputs = Readonly<{
  state: ViewerState;
  /** The open page of the menu; null: the menu is closed. */
  page: Page | null;
  /** Whether the last choice can be undone now. */
  canUndo: boolean;
  /** The mode of drawing volumes that is set when the user switches volumes on again. */
  lastMode: Mode;
}>;

type Slot = Readonly<{
  id: string;
  label: string;
  /** Label for use outside the bar, for example by a screen reader. */
  name?: string;
  isOn?: boolean;
  /** Drawn dim; choosing it has no effect. */
  isIdle?: boolean;
  to: CanvasRequest;
  more?: Partial<Region>;
}>;

/** Returns the buttons of both rows. null: an empty place. */
export function barOf(facts: BarInputs): Pick<Page, "marks" | "regions"> {
  const { page } = facts;
  const slots = page === null ? whileClosed(facts) : whileOpen(page);
  const marks: Mark[] = [];
  const regions: Region[] = [];
  slots.forEach((slot, i) => {
    if (slot === null) return;
    const column = i % COLUMNS;
    const rect: Rect = {
      ...SLOT,
      x: column * SLOT.width,
      y: ((i - column) / COLUMNS) * SLOT.height,
    };
    const { id, label, name = label, isOn = false, to, more = {} } = slot;
    marks.push(
      box(rect, isOn ? "accent" : "back", isOn ? null : "line"),
      text(rect, label, { align: "center", tone: isOn ? "ink" : "text" }),
    );
    regions.push({ id, label: name, rect, isSlide: false, to: () => to, ...more });
  });
  const undo = facts.canUndo ? undoAt(marks) : [];
  return { marks, regions: [...regions, ...undo] };
}

/**
 * Draws the button *Undo* at the lower left of the bar. It is shown only for some seconds after a
 * choice.
 */
function undoAt(marks: Mark[]): readonly Region[] {
  const rect: Rect = { ...SLOT, y: SLOT.height };
  marks.push(box(rect, "back", "accent"), text(rect, "Undo", { align: "center" }));
  return [
    {
      id: "undo-choice",
      label: "Undo the last choice",
      rect,
      isSlide: false,
      to: () => ({ canvas: "undo" }),
    },
  ];
}

function move(id: string, label: string): Slot {
  const found = MOVES.find((each) => each.id === id);
  if (found?.repeats === undefined) throw new Error(`no move ${id}`);
  const { name, repeats } = found;
  return { id: `bar-${id}`, label, name, to: repeats, more: { repeats, isStep: true } };
}

function whileClosed({ state, lastMode }: BarInputs): readonly (Slot | null)[] {
  const isOff = state.mode === "off";
  const volumes: Slot = {
    id: "bar-volumes",
    label: "Volume",
    name: isOff ? "Show volumes" : "Hide volumes",
    isOn: !isOff,
    to: setTo(MODE, isOff ? lastMode : "off"),
  };
  return [
    hasVolumes(state) ? volumes : null,
    move("nearer", "Nearer"),
    move("roll-left", "◂ Turn"),
    { id: "opener", label: "Menu", to: { canvas: "open" } },
    null,
    move("farther", "Farther"),
    move("roll-right", "Turn ▸"),
    {
      id: "bar-move",
      label: "Move",
      name: "Move the specimen with the gaze",
      to: { canvas: "carry" },
      more: { isCarry: true },
    },
  ];
}

function whileOpen({ page, count, up }: Page): readonly (Slot | null)[] {
  const name = `Next page (${page + 1} of ${count})`;
  const next = { canvas: "page", page: (page + 1) % count } as const;
  return [
    up === null ? null : { id: "up", label: "Back", to: { canvas: "back" } },
    count < 2 ? null : { id: "more", label: "Next", name, to: next, more: { isStep: true } },
    { id: "leave", label: "Leave", name: "Leave stereo", to: { canvas: "leave" } },
    { id: "close", label: "Close", to: { canvas: "close" } },
  ];
}

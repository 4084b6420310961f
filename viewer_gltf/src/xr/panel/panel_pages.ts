/** The open page of the headset panel, and navigation between its pages. */
import type { CanvasChange } from "../../panel/canvas/draw_list";
import { type CanvasView, START_CANVAS } from "../../panel/canvas/page";
import { SwatchFan } from "./swatch_fan";

export class PanelPages {
  readonly fan = new SwatchFan();
  private shown: CanvasView = START_CANVAS;
  /** The page number of the section from which a group was opened. */
  private sectionPage = 0;

  /** @param onNew called when another section or group opens */
  constructor(private readonly onNew: () => void) {}

  get view(): CanvasView {
    return this.shown;
  }

  begin(): void {
    this.go(START_CANVAS);
  }

  /**
   * Advances the time for which a swatch is gazed at. Returns whether the colours of another
   * channel are shown now.
   */
  advance(dt_s: number): boolean {
    const fanned = this.fan.advance(dt_s, this.shown.fanned);
    if (fanned === this.shown.fanned) return false;
    this.shown = { ...this.shown, fanned };
    return true;
  }

  /** Applies a change of page. Returns false if the change is of another kind. */
  follow(change: CanvasChange): boolean {
    const { shown } = this;
    switch (change.canvas) {
      case "tab":
        this.go({ ...START_CANVAS, tab: change.section });
        return true;
      case "fan":
        this.shown = { ...shown, fanned: change.group };
        return true;
      case "group":
        this.sectionPage = shown.page;
        this.go({ ...shown, group: change.group, page: 0, fanned: null });
        return true;
      case "page":
        this.shown = { ...shown, page: change.page, fanned: null };
        return true;
      case "back":
        if (shown.group === null) this.go({ ...START_CANVAS, tab: null });
        else this.go({ ...shown, group: null, page: this.sectionPage });
        return true;
      default:
        return false;
    }
  }

  private go(view: CanvasView): void {
    this.shown = view;
    this.onNew();
  }
}

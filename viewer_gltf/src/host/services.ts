/**
 * Services that a part offers to the others, by name. A part that uses one asks the host for it and gets null if no
 * part offers it, so that every part can be left out of the viewer.
 */
import type { HandleId } from "../marks/clip_handles";
import type { Refusal, Wish } from "../panel/controls";
import type { ObjectView } from "../state/objects";

/** `column`: the name of the one that colours. Of a row, one colour, or a palette's from end to end; none: words alone. */
export type ColorLegend = Readonly<{
  column: string;
  rows: readonly Readonly<{ colors: readonly string[]; text: string }>[];
}>;

/** The objects of the label maps that are shown. */
export interface ObjectMaps {
  /** Returns the legend of a channel's objects; null: they have the stage's colours, or have not come. */
  legend(channel: string): ColorLegend | null;
  /** Some of the objects' colours, by channel. */
  readonly colors: ReadonlyMap<string, readonly string[]>;
  /** Returns a link's text on a channel's objects, and how many it leaves out; null: their table has not come. */
  linked(channel: string, view: ObjectView): Readonly<{ text: string; leftOut: number }> | null;
  /** Rows of the objects that show, by channel. */
  readonly rowsShown: ReadonlyMap<string, readonly number[]>;
  /** How many objects of a channel show; null: their table has not come. */
  left(channel: string): number | null;
}

/** Pictures of the view, for whatever saves them. */
export interface PosterMaker {
  /** Makes an image of the screen, with a longest edge of at most so many pixels. Rejects with a DOMException. */
  poster(longest_px: number): Promise<Blob>;
}

/** The handles of cuts and lamps in the picture. */
export interface HandleLights {
  /** Lights up a handle; null: none. */
  highlight(handle: HandleId | null): void;
}

/** The measured points. */
export interface MeasuredPoints {
  /** For each measured point the values of the shown channels that have come, as `DAPI 1210`. */
  readonly values: readonly (readonly string[])[];
}

/** The panel in the page. */
export interface PagePanel {
  /** Grants a request of the panel or of a card. */
  perform(wish: Wish | Refusal): void;
  /** Brings the keyboard to a control, also of a panel that is hidden. Returns whether there is one. */
  focus(section: string, control: string): boolean;
  /** Offers a button beside the words that were announced last. */
  offer(words: string, label: string, act: () => void): void;
}

/** The buttons that lead on from a refusal. */
export interface MessageButtons {
  /** null: nothing leads on. */
  buttonFor(refusal: string): Promise<Readonly<{ label: string; act: () => void }> | null>;
}

export type Services = Readonly<{
  objects: ObjectMaps;
  posters: PosterMaker;
  handles: HandleLights;
  measured: MeasuredPoints;
  messages: MessageButtons;
  page: PagePanel;
}>;

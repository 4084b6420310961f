/**
 * The panel as plain data: sections of a few kinds of controls. The code that draws it, in HTML or on a
 * plane in the room, shows the values and hands back the wish that a control's `to` makes of what
 * the user did. Pure.
 */

import type { Shapes } from "../bundle/transfer_2d";
import type { Rgb } from "../math/color";
import type { Action } from "../state/actions";
import type { Command } from "../state/commands";
import type { HistogramPoint } from "../state/transfer_shapes";
import type { ClipPart } from "./clip_by_key";
import type { Grasp, Meant } from "./edit_shapes";

/** Of the viewer that a phone is put into: Google's of 2014, of 2015, another. */
export type Lenses = "v1" | "v2" | "own";

/** The panel's own state: it changes what is listed or meant, never the picture. */
export type PanelChange =
  | Readonly<{ panel: "find"; text: string }>
  | Readonly<{ panel: "page"; page: number }>
  /** The channel with the open card, which the channel keys mean; null: none. */
  | Readonly<{ panel: "pick"; channel: string | null }>
  /** The part of the cuts that the keys move. */
  | Readonly<{ panel: "clip-part"; clipPart: ClipPart }>
  /** The number of the light that the keys turn: see state/parameters/light.ts. */
  | Readonly<{ panel: "parameter"; parameter: string }>
  /** Open or close the joint histogram in a channel's card, which it opens. */
  | Readonly<{ panel: "histogram"; channel: string }>
  /** The shape that is meant, and what a pointer has hold of. */
  | Readonly<{ panel: "shape"; shape: Meant | null; grasp: Grasp | null }>
  /** The number of a shape that the keys change: see edit_shapes.ts. */
  | Readonly<{ panel: "shape-number"; id: string }>
  | Readonly<{ panel: "unfold"; section: string }>
  | Readonly<{ panel: "lenses"; lenses: Lenses }>
  /** Of the phone viewer's lenses, as its QR code has it. */
  | Readonly<{ panel: "code"; text: string }>
  /** Whether keys that write a character do anything (WCAG 2.1.4). */
  | Readonly<{ panel: "letters"; areOn: boolean }>
  /** The keys that differ from the tables: see keys.ts. */
  | Readonly<{ panel: "keys"; changes: Readonly<Record<string, string>> }>
  /** Open a section, and scroll to one of its controls. */
  | Readonly<{ panel: "reveal"; section: string; control: string }>
  | Readonly<{ panel: "hide" }>
  | Readonly<{ panel: "help" }>;

/** The request of a control or a key. */
export type Wish = Action | PanelChange | Command;

/** Why a request does nothing now, in a sentence. */
export type Refusal = Readonly<{ refusal: string }>;
/** A button beside a refusal, or in an empty picture: one step that leads on. */
export type Offer = Readonly<{ label: string; to: readonly (Action | Command)[] }>;

export type PanelView = Readonly<{
  search: string;
  /** The page of the list of channels that is shown, from 0. */
  page: number;
  /**
   * The channels with a card above the list, if there are many channels. They were shown when the section was
   * last opened. null: the channels that are shown now get the cards.
   */
  channelsWithCard: readonly string[] | null;
  picked: string | null;
  clipPart: ClipPart | null;
  parameter: string | null;
  isHistogramOpen: boolean;
  shape: Meant | null;
  grasp: Grasp | null;
  shapeNumber: string | null;
  /** Sections that are open. */
  open: readonly string[];
  lenses: Lenses;
  code: string;
  hasLetters: boolean;
  keyChanges: Readonly<Record<string, string>>;
  isHidden: boolean;
  isHelpOpen: boolean;
  /** The last link that was shared; "": none. */
  link: string;
}>;

export const START_VIEW: PanelView = {
  search: "",
  page: 0,
  channelsWithCard: null,
  picked: null,
  clipPart: null,
  parameter: null,
  isHistogramOpen: false,
  shape: null,
  grasp: null,
  shapeNumber: null,
  open: ["channels", "volumes"],
  lenses: "v2",
  code: "",
  hasLetters: true,
  keyChanges: {},
  isHidden: false,
  isHelpOpen: false,
  link: "",
};

type Base = Readonly<{
  /** Unique in the panel; of a channel's control: channel/part. */
  id: string;
  label: string;
  /** The label where there is no group around it: for screen readers, and for gaze. */
  name?: string;
  /** Why it can't be used; "" or absent: it can. */
  refusal?: string;
  /** What it does, in a sentence under it. */
  about?: string;
  /** Whether the refusal is always in view. */
  showsReason?: boolean;
}>;

export type Toggle = Base &
  Readonly<{ kind: "toggle"; value: boolean; to: (value: boolean) => Wish }>;
/** `value` 0..1, in so many steps; what it stands for is the text's. */
export type Slider = Base &
  Readonly<{
    kind: "slider";
    value: number;
    steps: number;
    text: string;
    to: (value: number) => Wish;
  }>;
/** Two ends of a range, each as a slider's value. */
export type Window = Base &
  Readonly<{
    kind: "window";
    value: readonly [number, number];
    steps: number;
    texts: readonly [string, string];
    to: (value: readonly [number, number]) => Wish;
  }>;
type Option = Readonly<{ value: string; label: string }>;
export type Choice = Base &
  Readonly<{
    kind: "choice";
    value: string;
    options: readonly Option[];
    /** Few and short: side by side. Otherwise a list to open. */
    isInline: boolean;
    to: (value: string) => Wish;
  }>;
export type Palette = Readonly<{
  name: string;
  colors: readonly Readonly<{ name: string; hex: string }>[];
}>;
/** `value` is #rrggbb. Without palettes any colour may be chosen. */
export type Colour = Base &
  Readonly<{
    kind: "colour";
    value: string;
    palettes: readonly Palette[];
    /** Eight colours that no other channel has, where there are other channels. */
    free?: readonly string[];
    /** Colours that it shows instead of its own; none or absent: nothing else. */
    shows?: readonly string[];
    to: (hex: string) => Wish;
  }>;
export type Button = Base &
  Readonly<{
    kind: "button";
    isPrimary?: boolean;
    /** Each press moves on by a step, as undoing does, so quick presses all count. */
    isStep?: boolean;
    /** Goes on with it, little by little, while it is held or gazed at. */
    repeats?: Command;
    to: () => Wish;
  }>;
export type MapTile = Readonly<{
  id: string;
  name: string;
  /** The tile's name, as it is written where it stands alone. */
  title: string;
  row: number;
  column: number;
  isFocus: boolean;
  isSelected: boolean;
  isIsolated: boolean;
}>;
export type TileMap = Base &
  Readonly<{
    kind: "map";
    rows: number;
    columns: number;
    tiles: readonly MapTile[];
    to: (tile: string) => Wish;
  }>;
/** The voxels of a channel by value and gradient. */
export type Histogram = Readonly<{
  /** 256 x 64 bytes, row 0 is gradient 0: the logarithm of the number of voxels. */
  cells: Uint8Array;
  /** A panel distinguishes pictures by their text: a name is enough. */
  toJSON: () => string;
}>;
/** Value to the right, gradient up: a histogram, and shapes that can be taken hold of. */
export type HistogramEditor = Base &
  Readonly<{
    kind: "histogram";
    /** null: it has not come. */
    histogram: Histogram | null;
    /** The part of the histogram's values that the plane is as wide as. */
    window: readonly [number, number];
    shapes: Shapes;
    selected: number | null;
    /** The channel's, linear. */
    color: Rgb;
    /** The lower and the upper end of the values, and the steepest gradient. */
    texts: readonly [string, string, string];
    /** @param reach how far off a corner or an edge may be */
    press: (at: HistogramPoint, reach: HistogramPoint) => Wish;
    /** null: nothing has changed by it. */
    drag: (at: HistogramPoint) => Wish | null;
  }>;
/** Whatever is drawn of something that only its owner knows. Places: shares of width and height, from the upper left. */
export type Picture = Base &
  Readonly<{
    kind: "picture";
    /** As a share of its width. */
    height: number;
    /** Changes with what is drawn. */
    version: string;
    draw: (context: CanvasRenderingContext2D, width: number, height: number) => void;
    /** It in words. */
    text: string;
    press: (x: number, y: number) => Wish;
    /** null: nothing has changed by it; absent: only a press does something. */
    drag?: (x: number, y: number) => Wish | null;
  }>;
/** What can only be read. */
export type Text = Base & Readonly<{ kind: "text"; value: string }>;
export type Search = Base &
  Readonly<{
    kind: "search";
    value: string;
    /** Texts to choose from where nobody can type. */
    hints?: readonly string[];
    to: (text: string) => Wish;
  }>;
/** An address to copy. */
export type Link = Base & Readonly<{ kind: "link"; value: string }>;

export type Control =
  | Toggle
  | Slider
  | Window
  | Choice
  | Colour
  | Button
  | TileMap
  | HistogramEditor
  | Picture
  | Text
  | Search
  | Link;

/** A channel: its name and what is always at hand; `more` only while it is open. */
export type Group = Readonly<{
  kind: "group";
  id: string;
  label: string;
  tags: readonly string[];
  /** What the tags mean, in a sentence; empty: nothing more. */
  about: string;
  /** Its channel is hidden, so its name is drawn dim. */
  isDimmed: boolean;
  /** Drawn as a row of a long list, not as a card. */
  isCompact?: boolean;
  controls: readonly Control[];
  more: readonly Control[];
  isOpen: boolean;
  /** Opens and closes it. */
  opener: PanelChange;
}>;

export type Section = Readonly<{
  id: string;
  label: string;
  /** On a flat screen it is listed under *More*. */
  isDeeper: boolean;
  isOpen: boolean;
  opener: PanelChange;
  items: readonly (Control | Group)[];
}>;

/** A section as the panel's own lists and the parts have it. */
export type PartSection = Pick<Section, "id" | "label" | "items"> &
  Readonly<{
    /** Place among the others: the panel's own have tens. */
    rank: number;
    /** Absent: it is listed with the first ones. */
    isDeeper?: boolean;
  }>;

export type Layout = Readonly<{
  title: string;
  subtitle: string;
  sections: readonly Section[];
  /** Opens and closes the list of the deeper sections. */
  more: Readonly<{ isOpen: boolean; opener: PanelChange }>;
  /** This line names the forms that are shown, and whether they are complete. It is always in view. */
  status: string;
  isHidden: boolean;
}>;

/** The next view of the panel. Returns the same object if nothing changes. */
export function changePanel(view: PanelView, change: PanelChange): PanelView {
  switch (change.panel) {
    case "find":
      return change.text === view.search ? view : { ...view, search: change.text, page: 0 };
    case "page":
      return change.page === view.page ? view : { ...view, page: change.page };
    case "pick":
      return change.channel === view.picked ? view : { ...view, picked: change.channel };
    case "clip-part":
      return change.clipPart === view.clipPart ? view : { ...view, clipPart: change.clipPart };
    case "parameter":
      return change.parameter === view.parameter ? view : { ...view, parameter: change.parameter };
    case "histogram": {
      const { channel } = change;
      const isOpen = view.isHistogramOpen && view.picked === channel;
      return { ...view, picked: channel, isHistogramOpen: !isOpen, shape: null, grasp: null };
    }
    case "shape":
      return { ...view, shape: change.shape, grasp: change.grasp };
    case "shape-number":
      return change.id === view.shapeNumber ? view : { ...view, shapeNumber: change.id };
    case "unfold": {
      const { section } = change;
      const isOpen = view.open.includes(section);
      const open = isOpen ? view.open.filter((id) => id !== section) : [...view.open, section];
      return { ...view, open };
    }
    case "reveal":
      return { ...view, isHidden: false, open: [...new Set([...view.open, change.section])] };
    case "lenses":
      return change.lenses === view.lenses ? view : { ...view, lenses: change.lenses };
    case "code":
      return change.text === view.code ? view : { ...view, code: change.text };
    case "letters":
      return change.areOn === view.hasLetters ? view : { ...view, hasLetters: change.areOn };
    case "keys":
      return { ...view, keyChanges: change.changes };
    case "hide":
      return { ...view, isHidden: !view.isHidden };
    case "help":
      return { ...view, isHelpOpen: !view.isHelpOpen };
  }
}

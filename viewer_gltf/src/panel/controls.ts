/**
 * The panel as plain data: sections of a few kinds of controls. The code that draws it, in HTML or
 * on a canvas in the scene, shows the values. It returns the request that a control's `to` makes
 * from the user's input. Pure.
 */

import type { Shapes } from "../bundle/transfer_2d";
import type { Rgb } from "../math/color";
import type { Action } from "../state/actions";
import type { Command } from "../state/commands";
import type { HistogramPoint } from "../state/transfer_shapes";
import type { ClipPart } from "./clip_by_key";
import type { Grab, SelectedShape } from "./edit_shapes";

/** Lens profile of a Cardboard viewer: Google's of 2014 or of 2015, or another one. */
export type Lenses = "v1" | "v2" | "own";

/** Changes of the panel's own state. They change what is listed or chosen in the panel, and not the scene. */
export type PanelChange =
  | Readonly<{ panel: "find"; text: string }>
  | Readonly<{ panel: "page"; page: number }>
  /** The channel with the open card, which the keys for channels change; null: none. */
  | Readonly<{ panel: "pick"; channel: string | null }>
  /** The part of the cuts that the keys move. */
  | Readonly<{ panel: "clip-part"; clipPart: ClipPart }>
  /** The number that the keys for numbers change (see state/parameters/light.ts). */
  | Readonly<{ panel: "parameter"; parameter: string }>
  /** Opens or closes the joint histogram in the card of a channel, and opens the card. */
  | Readonly<{ panel: "histogram"; channel: string }>
  /** The selected shape, and the part of it that a pointer drags. */
  | Readonly<{ panel: "shape"; shape: SelectedShape | null; grab: Grab | null }>
  /** The keys change one number of the selected shape, such as its opacity: see edit_shapes.ts. */
  | Readonly<{ panel: "shape-number"; id: string }>
  | Readonly<{ panel: "unfold"; section: string }>
  | Readonly<{ panel: "lenses"; lenses: Lenses }>
  /** Text of the QR code of a Cardboard viewer. */
  | Readonly<{ panel: "code"; text: string }>
  /** Whether keys that write a character have an effect (WCAG 2.1.4). */
  | Readonly<{ panel: "letters"; areOn: boolean }>
  /** The keys that the user has changed (see keys.ts). */
  | Readonly<{ panel: "keys"; changes: Readonly<Record<string, string>> }>
  /** Opens a section, and scrolls to one of its controls. */
  | Readonly<{ panel: "reveal"; section: string; control: string }>
  | Readonly<{ panel: "hide" }>
  | Readonly<{ panel: "help" }>;

/** The request of a control or a key. */
export type Request = Action | PanelChange | Command;

/** Why a request has no effect now, in a sentence. */
export type Refusal = Readonly<{ refusal: string }>;
/** A button beside a refusal or in an empty view, with the actions that solve the problem. */
export type Offer = Readonly<{ label: string; to: readonly (Action | Command)[] }>;

export type PanelView = Readonly<{
  search: string;
  /** The shown page of the list of channels, from 0. */
  page: number;
  /**
   * The channels with a card above the list, if there are many. They were shown when the section
   * was last opened. null: the channels that are shown now get the cards.
   */
  channelsWithCard: readonly string[] | null;
  picked: string | null;
  clipPart: ClipPart | null;
  parameter: string | null;
  isHistogramOpen: boolean;
  shape: SelectedShape | null;
  grab: Grab | null;
  shapeNumber: string | null;
  /** Ids of the open sections. */
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
  grab: null,
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
  /**
   * ID that is unique in the panel. For a channel's control, it is the channel's ID, a slash and
   * the control's own name.
   */
  id: string;
  label: string;
  /** Label for places without the group's name around it: for screen readers and gaze. */
  name?: string;
  /** Why the control cannot be used; "" or absent: it can. */
  refusal?: string;
  /** Explanation of the effect, in a sentence. */
  about?: string;
  /** Whether the refusal is always visible, and not only after a press. */
  showsReason?: boolean;
}>;

export type Toggle = Base &
  Readonly<{ kind: "toggle"; value: boolean; to: (value: boolean) => Request }>;
/**
 * `value` is the knob's position, 0..1. An arrow key moves it by 1 / `steps`. `text` is the
 * parameter's value with its unit.
 */
export type Slider = Base &
  Readonly<{
    kind: "slider";
    value: number;
    steps: number;
    text: string;
    to: (value: number) => Request;
  }>;
/** A slider with two knobs for the ends of a range, each with a position 0..1. */
export type Window = Base &
  Readonly<{
    kind: "window";
    value: readonly [number, number];
    steps: number;
    texts: readonly [string, string];
    to: (value: readonly [number, number]) => Request;
  }>;
type Option = Readonly<{ value: string; label: string }>;
export type Choice = Base &
  Readonly<{
    kind: "choice";
    value: string;
    options: readonly Option[];
    /** Whether the options are few and short, and stand side by side. Otherwise they open as a list. */
    isInline: boolean;
    to: (value: string) => Request;
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
    /** Eight colours that no other channel has, for controls of channels. */
    free?: readonly string[];
    /** Colours that are shown instead of the control's own; empty or absent: its own. */
    shows?: readonly string[];
    to: (hex: string) => Request;
  }>;
export type Button = Base &
  Readonly<{
    kind: "button";
    isPrimary?: boolean;
    /** Whether each press is a step, as with Undo, so that quick presses all count. */
    isStep?: boolean;
    /** Command that is repeated while the button is held or gazed at. */
    repeats?: Command;
    to: () => Request;
  }>;
export type MapTile = Readonly<{
  id: string;
  name: string;
  /** Name of the tile with a capital letter, for places that show nothing else beside it. */
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
    to: (tile: string) => Request;
  }>;
/** The joint histogram of a channel: its voxels by intensity and gradient magnitude. */
export type Histogram = Readonly<{
  /** 256 x 64 bytes; row 0 has gradient 0. A byte is the logarithm of the number of voxels. */
  cells: Uint8Array;
  /** Panels compare drawings by their JSON text, for which a name is enough. */
  toJSON: () => string;
}>;
/** A joint histogram with shapes that can be dragged: intensity to the right, gradient up. */
export type HistogramEditor = Base &
  Readonly<{
    kind: "histogram";
    /** The joint histogram that is drawn; null: not loaded yet. */
    histogram: Histogram | null;
    /** The range of intensities (0..1) that fills the width of the drawing. */
    window: readonly [number, number];
    shapes: Shapes;
    selected: number | null;
    /** Linear colour of the channel. */
    color: Rgb;
    /**
     * Labels of the axes: the intensity at the left and at the right end, and the gradient
     * magnitude at the top.
     */
    texts: readonly [string, string, string];
    /** @param reach largest distance to a corner or an edge */
    press: (at: HistogramPoint, reach: HistogramPoint) => Request;
    /** Returns the request of a drag to a point of the histogram; null: nothing changes. */
    drag: (at: HistogramPoint) => Request | null;
  }>;
/**
 * A drawing that the part of the viewer which owns it makes itself. Places are shares of its width
 * and height, from the upper left.
 */
export type Picture = Base &
  Readonly<{
    kind: "picture";
    /** Height, as a share of the width. */
    height: number;
    /** Changes with the content of the drawing. */
    version: string;
    draw: (context: CanvasRenderingContext2D, width: number, height: number) => void;
    /** The content in words. */
    text: string;
    press: (x: number, y: number) => Request;
    /**
     * Returns the request of a drag to a point; null: nothing changes. Absent: the picture takes
     * presses only.
     */
    drag?: (x: number, y: number) => Request | null;
  }>;
/** A text that can only be read. */
export type Text = Base & Readonly<{ kind: "text"; value: string }>;
export type Search = Base &
  Readonly<{
    kind: "search";
    value: string;
    /** Texts to choose from if nobody can type. */
    hints?: readonly string[];
    to: (text: string) => Request;
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

/** A channel or a lamp: its name and the controls that are always shown; `more` only while it is open. */
export type Group = Readonly<{
  kind: "group";
  id: string;
  label: string;
  tags: readonly string[];
  /** Meaning of the tags, in a sentence; "": nothing to add. */
  about: string;
  /** Whether the channel is hidden, so that its name is drawn dim. */
  isDimmed: boolean;
  /** Whether the group is drawn as a row of a long list, and not as a card. */
  isCompact?: boolean;
  controls: readonly Control[];
  more: readonly Control[];
  isOpen: boolean;
  /** Opens and closes the group. */
  opener: PanelChange;
}>;

export type Section = Readonly<{
  id: string;
  label: string;
  /** Whether a flat screen lists the section under *More*. */
  isDeeper: boolean;
  isOpen: boolean;
  opener: PanelChange;
  items: readonly (Control | Group)[];
}>;

/** A section as the panel's own lists and the parts define it. */
export type PartSection = Pick<Section, "id" | "label" | "items"> &
  Readonly<{
    /** Number by which sections are ordered; those of the panel itself have multiples of ten. */
    rank: number;
    /** Whether a flat screen lists the section under *More*; absent: it does not. */
    isDeeper?: boolean;
  }>;

export type Layout = Readonly<{
  title: string;
  subtitle: string;
  sections: readonly Section[];
  /** Opens and closes the list of the deeper sections. */
  more: Readonly<{ isOpen: boolean; opener: PanelChange }>;
  /** The line that names the shown forms and whether they are complete. It is always visible. */
  status: string;
  isHidden: boolean;
}>;

/** Returns the next view of the panel: the same object if nothing changes. */
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
      return { ...view, picked: channel, isHistogramOpen: !isOpen, shape: null, grab: null };
    }
    case "shape":
      return { ...view, shape: change.shape, grab: change.grab };
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

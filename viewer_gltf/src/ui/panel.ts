/** The panel: shows the state and turns what the user does into actions. Keeps no state of its own. */
import { fromHex, toHex } from "../color";
import { type Action, type ChannelState, MODES, type Mode, type ViewerState } from "../state";
import type { XrSupport } from "../xr/support";
import { element } from "./dom";

type Row = Readonly<{
  root: HTMLElement;
  shown: HTMLInputElement;
  color: HTMLInputElement;
  volume: HTMLInputElement;
  transferFunction: HTMLSelectElement;
}>;

const MODE_NAMES: Readonly<Record<Mode, string>> = {
  disc: "Disc",
  tile: "Tile",
  all: "All",
  stage: "Staged",
  off: "Off",
};

function tagsOf({ hasSurface, prefersVolume }: ChannelState): string[] {
  if (!hasSurface) return ["no surface"];
  return prefersVolume ? ["no clear surface"] : [];
}

export class Panel {
  readonly root: HTMLElement;
  private readonly rows = new Map<string, Row>();
  private readonly tile: HTMLSelectElement;
  private readonly modes = new Map<Mode, HTMLInputElement>();
  private readonly volumeSection: HTMLElement;
  private readonly stereo: HTMLButtonElement;
  private readonly reason: HTMLElement;
  private readonly status: HTMLElement;

  constructor(
    title: string,
    subtitle: string,
    state: ViewerState,
    private readonly dispatch: (action: Action) => void,
    onStereo: () => void,
    onReset: () => void,
  ) {
    const list = element("div", { className: "channels" });
    for (const channel of state.channels) {
      const row = this.makeRow(channel);
      this.rows.set(channel.id, row);
      list.append(row.root);
    }

    const isStaged = state.tiles.some((tile) => tile.representation !== "mesh");
    const modes = MODES.filter((mode) => mode !== "stage" || isStaged);
    for (const mode of modes) {
      const input = element(
        "input",
        {
          type: "radio",
          name: "mode",
          value: mode,
          onchange: () => dispatch({ type: "choose-mode", mode }),
        },
        { mode },
      );
      this.modes.set(mode, input);
    }
    this.tile = element(
      "select",
      {
        ariaLabel: "Tile drawn as a volume",
        onchange: () => dispatch({ type: "select", tile: this.tile.value || null }),
      },
      { tileChoice: "" },
      element("option", { value: "", textContent: "by gaze" }),
      ...state.tiles.map(({ id }) => element("option", { value: id, textContent: id })),
    );
    this.volumeSection = element(
      "section",
      { className: "volumes" },
      {},
      element("h2", { textContent: "Volumes" }),
      element(
        "div",
        { className: "segmented" },
        {},
        ...[...this.modes].map(([mode, input]) =>
          element("label", {}, {}, input, element("span", { textContent: MODE_NAMES[mode] })),
        ),
      ),
      element(
        "label",
        { className: "field" },
        {},
        element("span", { textContent: "Tile" }),
        this.tile,
      ),
      element("p", {
        className: "hint",
        textContent: "Come near: volumes show round the middle of the view.",
      }),
    );

    this.stereo = element(
      "button",
      { className: "primary", disabled: true, textContent: "Enter stereo (VR)", onclick: onStereo },
      { action: "stereo" },
    );
    this.reason = element("p", { className: "hint" }, { stereoReason: "" });
    this.status = element("p", { className: "status" }, { status: "" });
    const body = element(
      "div",
      { className: "body" },
      {},
      element("section", {}, {}, element("h2", { textContent: "Channels" }), list),
      this.volumeSection,
      element(
        "section",
        { className: "actions" },
        {},
        this.stereo,
        this.reason,
        element("button", { textContent: "Reset view", onclick: onReset }, { action: "reset" }),
      ),
      this.status,
    );
    const fold = element("button", { className: "fold", ariaLabel: "Fold the panel" });
    fold.onclick = () => {
      const isFolded = this.root.classList.toggle("folded");
      fold.ariaExpanded = String(!isFolded);
    };
    this.root = element(
      "aside",
      { className: "panel" },
      {},
      element(
        "header",
        {},
        {},
        element(
          "div",
          {},
          {},
          element("h1", { textContent: title, title }),
          element("p", { className: "hint", textContent: subtitle }),
        ),
        fold,
      ),
      body,
    );
    this.update(state);
  }

  private makeRow(channel: ChannelState): Row {
    const { dispatch } = this;
    const { id, name } = channel;
    const shown = element("input", {
      type: "checkbox",
      className: "switch",
      ariaLabel: `Show ${name}`,
      onchange: () => dispatch({ type: "show", channel: id, shown: shown.checked }),
    });
    const color = element("input", {
      type: "color",
      ariaLabel: `Colour of ${name}`,
      oninput: () => dispatch({ type: "recolor", channel: id, color: fromHex(color.value) }),
    });
    const volume = element("input", {
      type: "checkbox",
      ariaLabel: `Draw ${name} as a volume`,
      onchange: () => dispatch({ type: "draw-volume", channel: id, volume: volume.checked }),
    });
    const transferFunction = element(
      "select",
      {
        ariaLabel: `Transfer function of ${name}`,
        onchange: () =>
          dispatch({
            type: "choose-transfer-function",
            channel: id,
            name: transferFunction.value,
          }),
      },
      {},
      ...channel.transferFunctions.map((each) =>
        element("option", { value: each, textContent: each }),
      ),
    );
    for (const [input, part] of [
      [shown, "shown"],
      [color, "color"],
      [volume, "volume"],
      [transferFunction, "transfer-function"],
    ] as const) {
      input.dataset.part = part;
    }
    const root = element(
      "div",
      { className: "channel" },
      { channel: id },
      color,
      element("span", { className: "name", textContent: name, title: name }),
      shown,
      element(
        "div",
        { className: "look" },
        {},
        element(
          "label",
          { className: "chip" },
          {},
          volume,
          element("span", { textContent: "Volume" }),
        ),
        transferFunction,
        ...tagsOf(channel).map((text) => element("span", { className: "tag", textContent: text })),
      ),
    );
    return { root, shown, color, volume, transferFunction };
  }

  update(state: ViewerState): void {
    for (const channel of state.channels) {
      const row = this.rows.get(channel.id);
      if (row === undefined) continue;
      row.root.classList.toggle("off", !channel.shown);
      row.root.classList.toggle("as-volume", channel.volume);
      row.shown.checked = channel.shown;
      row.volume.checked = channel.volume;
      row.color.value = toHex(channel.color);
      row.transferFunction.value = channel.transferFunction;
    }
    this.volumeSection.hidden = !state.channels.some((c) => c.shown && c.volume);
    const mode = this.modes.get(state.mode);
    if (mode !== undefined) mode.checked = true;
    this.tile.value = state.selected ?? "";
  }

  setStereo({ isAvailable, reason }: XrSupport): void {
    this.stereo.disabled = !isAvailable;
    this.reason.textContent = reason;
    this.reason.hidden = reason === "";
  }

  setStatus(text: string): void {
    if (this.status.textContent !== text) this.status.textContent = text;
  }
}

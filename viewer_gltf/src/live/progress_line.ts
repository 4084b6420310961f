/** A slim line at the bottom of the page with the build's progress, and with buttons to pause and cancel it. */
import { element, setText } from "../dom/element";
import type { Command } from "./build_feed";
import { type BuildState, wordsOf } from "./build_state";

const GONE = "The server does not answer. The view stays, and this page keeps trying.";

export class ProgressLine {
  private readonly fill = element("div", { className: "fill" });
  private readonly words = element("span", { role: "status" }, { live: "words" });
  private readonly buttons: Readonly<Record<Command, HTMLButtonElement>>;
  private readonly close = element(
    "button",
    { type: "button", textContent: "×", ariaLabel: "Dismiss" },
    { live: "dismiss" },
  );
  private readonly root: HTMLElement;
  /** The state in which the user has dismissed the line; empty if the line is not dismissed. */
  private dismissed = "";

  /** @param parent contains the line while there is something to report */
  constructor(
    private readonly parent: HTMLElement,
    onCommand: (command: Command) => void,
  ) {
    const button = (command: Command, textContent: string) =>
      element(
        "button",
        { type: "button", textContent, onclick: () => onCommand(command) },
        { live: command },
      );
    this.buttons = {
      pause: button("pause", "Pause"),
      continue: button("continue", "Continue"),
      cancel: button("cancel", "Cancel"),
    };
    this.close.onclick = () => {
      this.dismissed = this.root.dataset.doing ?? "";
      this.root.remove();
    };
    this.root = element(
      "aside",
      { className: "build", ariaLabel: "The build" },
      {},
      element("div", { className: "track" }, {}, this.fill),
      this.words,
      ...Object.values(this.buttons),
      this.close,
    );
  }

  /**
   * @param state null if the server does not answer
   * @param isShown whether the page shows the newest bundle of the build
   */
  update(state: BuildState | null, isShown: boolean): void {
    const doing = state?.doing ?? null;
    const words = state === null ? GONE : wordsOf(state, isShown);
    if (words !== this.dismissed) this.root.hidden = false;
    setText(this.words, words);
    this.words.title = words; // a narrow window cuts the text off
    if (state !== null) this.fill.style.width = `${100 * state.share}%`;
    this.root.dataset.doing = doing ?? "gone";
    const isFocused = this.root.contains(document.activeElement);
    if (this.dismissed !== this.root.dataset.doing) this.dismissed = "";
    if (words === "" || this.dismissed !== "") this.root.remove();
    else if (!this.root.isConnected) this.parent.append(this.root);
    const may = state?.mayControl === true;
    const isOver = doing === "cancelled" || doing === "failed";
    this.buttons.pause.hidden = !may || doing !== "building";
    this.buttons.continue.hidden =
      !may || !(isOver ? state?.mayContinue : doing === "paused" || doing === "pausing");
    this.buttons.cancel.hidden =
      !may || !["queued", "building", "pausing", "paused"].includes(doing ?? "");
    this.close.hidden = !(isOver || doing === "deleted" || (doing === "complete" && isShown));
    this.keepFocus(isFocused);
  }

  /** Moves the focus to the first visible button if the focused one has just been hidden. */
  private keepFocus(isFocused: boolean): void {
    const buttons = [...Object.values(this.buttons), this.close];
    const { activeElement } = document;
    if (!isFocused || buttons.some((each) => each === activeElement && !each.hidden)) return;
    buttons.find((each) => !each.hidden)?.focus();
  }
}

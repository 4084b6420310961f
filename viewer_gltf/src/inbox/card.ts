/** The card of one item on the page. It is updated in place, so that the focus stays when the item changes. */
import { arrange, element, setText } from "../dom/element";
import { type Action, type ActionName, actionsOf, canChoose, type Situation } from "./actions";
import { factsView, notesView, slicesView, summaryOf } from "./facts";
import type { Item, Limits } from "./inbox_state";
import type { Choices } from "./server";
import { NAMES } from "./setting_names";
import { isSameForm, settingsForm } from "./settings_form";
import { spacingField } from "./spacing_field";
import type { Understood } from "./understood";
import { shareOf, stateName, wordsOf } from "./words";

export type CardCalls = Readonly<{
  act: (item: Item, action: ActionName, keepsUpload: boolean) => void;
  choose: (item: Item, choices: Choices) => void;
}>;

export type Shown = Readonly<{
  item: Item;
  situation: Situation;
  understood: Understood | null;
  limits: Limits;
  /** Name of the dropped file or folder, which the server does not report; empty: it was dropped elsewhere. */
  ownName: string;
  /** Whether an action of the user is under way. */
  isBusy: boolean;
  /** Why the last action was refused; empty: it was not. */
  fault: string;
  /** Number of the reading, which makes the addresses of its images differ from those of earlier readings. */
  reading: number;
}>;

export class Card {
  readonly root: HTMLElement;
  private readonly title: HTMLElement;
  private readonly badge = element("span", { className: "badge" }, { state: "" });
  private readonly summary = element("p", { className: "summary" });
  private readonly words = element("p", { className: "words" }, { words: "" });
  private readonly fault = element("p", { className: "fault", role: "alert" }, { fault: "" });
  private readonly bar = element("progress", { max: 1 });
  private readonly question: HTMLElement;
  private readonly what = element("div", { className: "what" });
  private readonly keep = element("input", { type: "checkbox", className: "switch" });
  private readonly keepRow: HTMLElement;
  private readonly actions = element("div", { className: "buttons" }, { actions: "" });
  private readonly buttons = new Map<ActionName, HTMLElement>();
  private form: HTMLFormElement | null = null;
  private understood: Understood | null = null;
  private shown: Shown | null = null;

  constructor(
    private readonly id: string,
    private readonly calls: CardCalls,
  ) {
    this.title = element("h2", { id: `title-${id}`, tabIndex: -1 });
    const keepName = element("span", { textContent: "Keep the upload after the build" });
    const why = element("small", {
      textContent: "Otherwise the server deletes it once the specimen is built.",
    });
    const keepWords = element("span", {}, {}, keepName, why);
    this.keepRow = element("label", { className: "keep" }, { keep: "" }, this.keep, keepWords);
    this.question = this.spacingQuestion();
    this.root = element(
      "article",
      { className: "card" },
      { item: id },
      element("header", {}, {}, this.title, this.badge),
      this.summary,
      this.words,
      this.bar,
      this.fault,
      this.question,
      this.what,
      this.keepRow,
      this.actions,
    );
    this.root.setAttribute("aria-labelledby", this.title.id);
  }

  focus(): void {
    this.title.focus();
  }

  update(shown: Shown): void {
    this.shown = shown;
    const { item, situation, understood, limits, ownName, fault } = shown;
    const { upload, isMoving } = situation;
    this.root.dataset.doing = item.doing;
    this.root.dataset.upload = upload?.doing ?? "";
    this.root.dataset.rests = String(!canChoose(item));
    setText(this.title, titleOf(item, ownName));
    setText(this.summary, understood === null ? "" : summaryOf(understood));
    setText(this.badge, stateName(item, upload, isMoving));
    setText(this.words, wordsOf(item, upload, isMoving, limits));
    setText(this.fault, fault);
    this.fault.hidden = fault === "";
    this.showShare(shareOf(item, upload), item.doing === "uploading" ? "Upload" : "Build");
    if (understood !== null) this.showUnderstood(understood, shown);
    this.question.hidden = !item.asksSpacing || !situation.mayUpload;
    this.what.hidden = understood === null || item.asksSpacing;
    this.what.dataset.old = String(item.doing === "understanding");
    if (this.form !== null) {
      this.form.hidden = !situation.mayUpload || !canChoose(item);
    }
    this.showActions(actionsOf(item, situation), shown);
  }

  /** A form for the voxel spacing, for files that state none, because they can't be read without it. */
  private spacingQuestion(): HTMLElement {
    const field = spacingField(`ask-${this.id}`, [], () => undefined);
    const go = element("button", { type: "submit", className: "primary", textContent: "Continue" });
    const form = element(
      "form",
      { className: "question", noValidate: true, ariaLabel: NAMES.spacing },
      {},
      field.root,
      element("div", { className: "buttons" }, {}, go),
    );
    form.onsubmit = (event) => {
      event.preventDefault(); // the page's security policy forbids sending forms
      const spacing_um = field.read();
      if (spacing_um === null) form.querySelector("input")?.focus();
      else if (this.shown !== null) this.calls.choose(this.shown.item, { spacing_um });
    };
    return form;
  }

  private showShare(share: number | null, name: string): void {
    this.bar.hidden = share === null;
    if (share === null) return;
    this.bar.value = share;
    this.bar.ariaLabel = name;
  }

  private showUnderstood(understood: Understood, { item, reading }: Shown): void {
    if (understood === this.understood) return;
    const before = this.understood;
    this.understood = understood;
    const address = (image: string) => `items/${item.id}/${image}?reading=${reading}`;
    if (this.form === null || before === null || !isSameForm(before, understood)) {
      this.form = this.newForm(understood);
    }
    const slices = slicesView(understood, address);
    const about = element("div", { className: "about" }, {}, factsView(understood));
    arrange(this.what, [slices, this.form, about, notesView(understood)]);
  }

  /** Makes a form with the new contents, and returns the focus to the same setting. */
  private newForm(understood: Understood): HTMLFormElement {
    const focused = document.activeElement;
    const at = this.form?.contains(focused) ? settingOf(focused) : null;
    const form = settingsForm(understood, `item-${this.id}`, (choices) => {
      if (this.shown !== null) this.calls.choose(this.shown.item, choices);
    });
    if (at !== null) {
      queueMicrotask(() =>
        [...form.querySelectorAll<HTMLElement>("[data-setting]")]
          .find((each) => settingOf(each) === at)
          ?.focus(),
      );
    }
    return form;
  }

  private showActions(actions: readonly Action[], { item, isBusy }: Shown): void {
    arrange(
      this.actions,
      actions.map((action) => this.buttonOf(action, item)),
    );
    for (const button of this.buttons.values()) button.ariaDisabled = String(isBusy);
    const builds = actions.some(({ name }) => name === "build");
    this.keepRow.hidden = !builds || !item.hasUpload;
  }

  /** Makes a link if the action opens an existing page, and a button otherwise. */
  private buttonOf({ name, label, isPrimary = false }: Action, item: Item): HTMLElement {
    let button = this.buttons.get(name);
    if (button === undefined) {
      button =
        name === "open"
          ? element("a", { target: "_blank", rel: "noopener" }, { action: name })
          : element("button", { type: "button" }, { action: name });
      if (name !== "open") button.onclick = () => this.press(name);
      this.buttons.set(name, button);
    }
    if (button instanceof HTMLAnchorElement) button.href = item.page;
    button.className = isPrimary ? "primary" : name === "delete" ? "quiet" : "";
    setText(button, label);
    button.setAttribute("aria-describedby", this.title.id);
    return button;
  }

  private press(name: ActionName): void {
    if (this.shown === null || this.shown.isBusy) return;
    this.calls.act(this.shown.item, name, this.keep.checked);
  }
}

/** Returns the title of an item; until the server has read it, the name of the dropped file. */
export function titleOf({ title, doing }: Item, ownName: string): string {
  return title || ownName || (doing === "uploading" ? "An upload" : "A new image");
}

/** Returns a key that identifies a control within its form. */
function settingOf(control: Element | null): string | null {
  if (!(control instanceof HTMLElement)) return null;
  const { setting } = control.dataset;
  const value =
    control instanceof HTMLInputElement && control.type === "checkbox" ? control.value : "";
  return setting === undefined ? null : `${setting} ${value}`;
}

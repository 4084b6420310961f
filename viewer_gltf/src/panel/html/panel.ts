/** The panel in HTML: draws a layout and sends requests. It keeps no state of its own. */

import { arrange, element, setText } from "../../dom/element";
import type { Control, Group, Layout, Section } from "../controls";
import { ignoreSecondClicks } from "./double_click";
import type { Send, Widget } from "./widget";
import { makeWidget } from "./widgets";

type Item = Control | Group;

/** Returns a key that changes when an item needs another element. */
function shapeOf(item: Item): string {
  if (item.kind !== "group") return item.id;
  const opens = item.more.length > 0 ? "opens" : "";
  return `${item.id}, group of ${item.controls.length} ${opens}`;
}

/** The elements of a list of controls. Each stays as long as its control is listed. */
export class Items {
  private readonly made = new Map<string, Widget<Item>>();

  constructor(
    readonly root: HTMLElement,
    private readonly send: Send,
  ) {}

  update(items: readonly Item[]): void {
    const roots = items.map((item) => {
      const shape = shapeOf(item);
      let widget = this.made.get(shape);
      if (widget === undefined) {
        widget = (
          item.kind === "group" ? makeGroup(item, this.send) : makeWidget(item, this.send)
        ) as Widget<Item>;
        widget.root.classList.add(`item-${item.id.slice(item.id.indexOf("/") + 1)}`);
        this.made.set(shape, widget);
      }
      widget.update(item);
      return widget.root;
    });
    arrange(this.root, roots);
    const listed = new Set(items.map(shapeOf));
    for (const shape of this.made.keys()) if (!listed.has(shape)) this.made.delete(shape);
  }
}

/** Makes a channel, as a card or as a row of a long list. */
function makeGroup(first: Group, send: Send): Widget<Group> {
  let now = first;
  const canOpen = first.more.length > 0;
  const name = canOpen
    ? element(
        "button",
        { type: "button", className: "name opener", onclick: () => send(now.opener) },
        { opener: first.id },
      )
    : element("span", { className: "name" });
  const tags = element("span", { className: "tags" });
  const always = new Items(element("div", { className: "always" }), send);
  const more = new Items(element("div", { className: "more" }), send);
  const root = element(
    "div",
    { className: "channel", role: "group", ariaLabel: first.label },
    { channel: first.id },
    name,
    always.root,
    tags,
    more.root,
  );
  return {
    root,
    update(group) {
      now = group;
      root.classList.toggle("compact", group.isCompact === true);
      root.classList.toggle("dimmed", group.isDimmed);
      setText(name, group.label);
      name.title = group.label;
      if (canOpen) name.ariaExpanded = String(group.isOpen);
      setText(tags, group.tags.join(", "));
      tags.title = group.about;
      always.update(group.controls);
      more.root.hidden = !group.isOpen;
      more.update(group.isOpen ? group.more : []);
    },
  };
}

function makeSection(first: Section, send: Send): Widget<Section> {
  let now = first;
  const opener = element(
    "button",
    {
      type: "button",
      className: "opener",
      textContent: first.label,
      onclick: () => send(now.opener),
    },
    { opener: first.id },
  );
  const items = new Items(element("div", { className: "items", id: `items-${first.id}` }), send);
  opener.setAttribute("aria-controls", items.root.id);
  return {
    root: element(
      "section",
      { ariaLabel: first.label },
      { section: first.id },
      element("h2", {}, {}, opener),
      items.root,
    ),
    update(section) {
      now = section;
      opener.ariaExpanded = String(section.isOpen);
      items.root.hidden = !section.isOpen;
      items.update(section.isOpen ? section.items : []);
    },
  };
}

export class Panel {
  readonly root: HTMLElement;
  private readonly title = element("h1");
  private readonly subtitle = element("p", { className: "hint" });
  private readonly body = element("div", { className: "body", id: "panel-body" });
  private readonly status = element("p", { className: "status" }, { status: "" });
  private readonly fold: HTMLButtonElement;
  private readonly sections = new Map<string, Widget<Section>>();
  /** The list of the deeper sections, and the button that opens it. */
  private readonly more = element("div", { className: "deeper", id: "panel-more" });
  private readonly moreOpener: HTMLButtonElement;
  private readonly moreRoot: HTMLElement;
  private layout: Layout | null = null;

  constructor(private readonly send: Send) {
    this.moreOpener = element(
      "button",
      {
        type: "button",
        className: "opener",
        textContent: "More",
        onclick: () => this.layout && send(this.layout.more.opener),
      },
      { opener: "more" },
    );
    this.moreOpener.setAttribute("aria-controls", this.more.id);
    this.moreRoot = element(
      "section",
      { ariaLabel: "More" },
      { section: "more" },
      element("h2", {}, {}, this.moreOpener),
      this.more,
    );
    this.fold = element("button", {
      type: "button",
      className: "fold",
      ariaLabel: "Panel",
      title: "Hide or show the panel",
      onclick: () => send({ panel: "hide" }),
    });
    this.fold.setAttribute("aria-controls", this.body.id);
    this.root = element(
      "aside",
      { className: "panel", ariaLabel: "Controls" },
      {},
      element("header", {}, {}, element("div", {}, {}, this.title, this.subtitle), this.fold),
      this.body,
      this.status,
    );
    ignoreSecondClicks(this.root);
  }

  update(layout: Layout): void {
    const { activeElement } = document;
    const focused =
      activeElement instanceof HTMLElement ? activeElement.dataset.control : undefined;
    setText(this.title, layout.title);
    this.title.title = layout.title;
    setText(this.subtitle, layout.subtitle);
    setText(this.status, layout.status);
    this.status.title = layout.status;
    this.root.classList.toggle("folded", layout.isHidden);
    this.fold.ariaExpanded = String(!layout.isHidden);
    this.layout = layout;
    const { isOpen } = layout.more;
    this.moreOpener.ariaExpanded = String(isOpen);
    this.more.hidden = !isOpen;
    const first = layout.sections.filter(({ isDeeper }) => !isDeeper);
    const deeper = layout.sections.filter(({ isDeeper }) => isDeeper && isOpen);
    arrange(
      this.more,
      deeper.map((section) => this.rootOf(section)),
    );
    arrange(this.body, [...first.map((section) => this.rootOf(section)), this.moreRoot]);
    // A channel that is shown or hidden may move in the list, and takes the focus with it.
    if (focused !== undefined && document.activeElement !== activeElement) this.focus(focused);
  }

  private rootOf(section: Section): HTMLElement {
    let widget = this.sections.get(section.id);
    if (widget === undefined) {
      widget = makeSection(section, this.send);
      this.sections.set(section.id, widget);
    }
    widget.update(section);
    return widget.root;
  }

  /** Focuses a control by its id. Returns whether the panel has it. */
  focus(id: string): boolean {
    const found = this.find(id);
    found?.focus();
    return found !== null;
  }

  /** Scrolls a control into view. A control in a closed section or a hidden panel does not scroll. */
  reveal(id: string): void {
    const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.find(id)?.scrollIntoView({ block: "nearest", behavior: isCalm ? "auto" : "smooth" });
  }

  private find(id: string): HTMLElement | null {
    return this.root.querySelector(`[data-control="${CSS.escape(id)}"]:not([tabindex="-1"])`);
  }
}

/** Why the view is empty, in its middle, with a button that leads back. */
import "./view_message.css";
import { element, setText } from "../../dom/element";

export type Message = Readonly<{ text: string; label: string; act: () => void }>;

export class ViewMessage {
  private readonly words = element("p");
  private readonly button = element(
    "button",
    { type: "button", className: "primary", onclick: () => this.message?.act() },
    { action: "way-back" },
  );
  private readonly root = element(
    "div",
    { className: "view-message", role: "status", hidden: true },
    { viewMessage: "" },
    this.words,
    this.button,
  );
  private message: Message | null = null;

  /** @param view the part of the page with the canvas */
  constructor(view: HTMLElement) {
    view.querySelector(".stage")?.after(this.root);
  }

  /** @param message null: the view is not empty */
  show(message: Message | null): void {
    this.message = message;
    this.root.hidden = message === null;
    if (message === null) return;
    setText(this.words, message.text);
    setText(this.button, message.label);
  }

  dispose(): void {
    this.root.remove();
  }
}

/** Asks for confirmation before something is lost. */
import { element } from "../dom/element";

/** Resolves to whether the user agrees. The focus then returns to the element that had it before. */
export function ask(title: string, words: string, agree: string): Promise<boolean> {
  const no = element("button", { type: "button", textContent: "Keep it", value: "" });
  const yes = element("button", { type: "button", textContent: agree, className: "alarming" });
  const dialog = element(
    "dialog",
    { className: "ask" },
    { ask: "" },
    element("h2", { textContent: title, id: "ask-title" }),
    element("p", { textContent: words, id: "ask-words" }),
    element("div", { className: "buttons" }, {}, no, yes),
  );
  dialog.setAttribute("aria-labelledby", "ask-title");
  dialog.setAttribute("aria-describedby", "ask-words");
  return new Promise((resolve) => {
    no.onclick = () => dialog.close("no");
    yes.onclick = () => dialog.close("yes");
    dialog.onclose = () => {
      dialog.remove();
      resolve(dialog.returnValue === "yes");
    };
    document.body.append(dialog);
    dialog.showModal();
    no.focus();
  });
}

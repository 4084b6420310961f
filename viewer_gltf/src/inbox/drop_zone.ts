/** The area of the page where users drop images, choose them, or enter their address. */
import { element, setText } from "../dom/element";
import { chosenFiles, type Dropped, droppedFiles } from "./dropped_files";

export type HandIn = Readonly<{
  files: (dropped: Dropped) => void;
  address: (address: string) => Promise<boolean>;
}>;

export class DropZone {
  readonly root: HTMLElement;
  private readonly status = element(
    "p",
    { className: "status-line", role: "status" },
    { zone: "" },
  );

  constructor(private readonly handIn: HandIn) {
    this.root = element(
      "section",
      { className: "zone", ariaLabel: "Add an image" },
      {},
      element("h2", { textContent: "Drop an image here" }),
      element("p", {
        className: "hint",
        textContent:
          "A file, a folder or a zip: DICOM, NIfTI, TIFF, OME-Zarr, CZI and more. Everything that you drop at once is " +
          "one specimen.",
      }),
      this.choices(),
      this.addressForm(),
      this.status,
    );
  }

  /** @param isFault whether the text reports an error */
  showText(text: string, isFault = false): void {
    this.status.classList.toggle("fault", isFault);
    setText(this.status, text);
  }

  /** Accepts drops anywhere on the page while `isOpen` returns true. */
  listen(isOpen: () => boolean): void {
    let depth = 0; // the browser reports entering and leaving for each nested element
    const mark = () => {
      document.documentElement.dataset.over = String(depth > 0 && isOpen());
    };
    addEventListener("dragover", (event) => event.preventDefault()); // otherwise the browser would open the file itself
    addEventListener("dragenter", () => {
      depth++;
      mark();
    });
    addEventListener("dragleave", () => {
      depth = Math.max(0, depth - 1);
      mark();
    });
    addEventListener("drop", (event) => {
      event.preventDefault();
      depth = 0;
      mark();
      const { dataTransfer } = event;
      if (dataTransfer === null || !isOpen()) return;
      const address = dataTransfer.getData("text/uri-list").split("\n")[0].trim();
      if (dataTransfer.files.length === 0 && address !== "") void this.handIn.address(address);
      else this.handIn.files(droppedFiles(dataTransfer));
    });
  }

  /** Buttons for users who can't drag a file. */
  private choices(): HTMLElement {
    const input = (choose: string, properties: Partial<HTMLInputElement>) => {
      const made = element("input", { type: "file", hidden: true, ...properties }, { choose });
      made.onchange = () => {
        const files = chosenFiles(made.files ?? []);
        made.value = ""; // so that choosing the same files again is reported
        this.handIn.files({ handles: Promise.resolve([]), files: async () => files });
      };
      return made;
    };
    const files = input("files", { multiple: true });
    const folder = input("folder", { webkitdirectory: true });
    const button = (textContent: string, opened: HTMLInputElement) =>
      element("button", { type: "button", textContent, onclick: () => opened.click() });
    return element(
      "div",
      { className: "buttons" },
      {},
      button("Choose files", files),
      button("Choose a folder", folder),
      files,
      folder,
    );
  }

  private addressForm(): HTMLElement {
    const field = element(
      "input",
      {
        type: "text",
        inputMode: "url",
        id: "address",
        placeholder: "https:// or s3://",
        autocomplete: "off",
        spellcheck: false,
      },
      { address: "" },
    );
    const label = element("label", { textContent: "Or paste an address", htmlFor: field.id });
    const add = element("button", { type: "submit", textContent: "Add" });
    const form = element("form", { className: "address", noValidate: true }, {}, label, field, add);
    form.onsubmit = async (event) => {
      event.preventDefault(); // the page's security policy forbids sending forms
      const address = field.value.trim();
      if (address === "") {
        this.showText("Paste the address of an image first.", true);
        field.focus();
      } else if (await this.handIn.address(address)) field.value = "";
    };
    return form;
  }
}

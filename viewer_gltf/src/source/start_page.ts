/** The page of a viewer without a bundle. The user drops a source on it, chooses one, or enters its address. */
import "./start_page.css";
import { BundleError } from "../bundle/errors";
import { element, setText } from "../dom/element";
import { chosenFolder, droppedSource } from "./dropped";
import { type LocalSource, openLocal, type ShownSource } from "./open_source";

/** Shows the page. Resolves once a source is open. */
export function chooseSource(parent: HTMLElement): Promise<ShownSource> {
  return new Promise((resolve) => {
    const status = element("p", { role: "status" }, { sourceStatus: "" });
    const over = new AbortController();
    let isBusy = false;
    const open = async (source: LocalSource | null) => {
      if (source === null || isBusy) return;
      isBusy = true;
      page.classList.remove("over");
      status.classList.remove("fault");
      try {
        const opened = await openLocal(source, (text) => setText(status, text));
        over.abort();
        resolve(opened);
      } catch (error) {
        status.classList.add("fault");
        setText(status, error instanceof BundleError ? error.message : String(error));
        if (!(error instanceof BundleError)) throw error;
      } finally {
        isBusy = false;
      }
    };
    const page = element(
      "main",
      { className: "start-page" },
      { startPage: "" },
      element("h1", { textContent: "StereoCell" }),
      element("p", {
        textContent:
          "Drop a NIfTI file, an OME-Zarr folder or a zipped OME-Zarr image (.ozx) here. The image is read in this " +
          "page and does not leave this device.",
      }),
      element("div", { className: "choices" }, {}, ...choices(open)),
      addressForm(),
      status,
    );
    parent.replaceChildren(page);
    const { signal } = over;
    addEventListener(
      "dragover",
      (event) => {
        event.preventDefault(); // otherwise the browser would open the file itself
        page.classList.add("over");
      },
      { signal },
    );
    addEventListener("dragleave", () => page.classList.remove("over"), { signal });
    addEventListener(
      "drop",
      (event) => {
        event.preventDefault();
        if (event.dataTransfer !== null) void open(droppedSource(event.dataTransfer));
      },
      { signal },
    );
  });
}

/** Buttons for users who can't drag a file. */
function choices(open: (source: LocalSource | null) => Promise<void>): readonly HTMLElement[] {
  const file = element(
    "input",
    { type: "file", accept: ".nii,.gz,.ozx,.zip", hidden: true },
    { choose: "file" },
  );
  const folder = element(
    "input",
    { type: "file", webkitdirectory: true, hidden: true },
    { choose: "folder" },
  );
  file.onchange = () => {
    const [chosen] = file.files ?? [];
    void open(chosen === undefined ? null : { kind: "file", file: chosen });
  };
  folder.onchange = () => void open(folder.files && chosenFolder(folder.files));
  return [
    element("button", {
      type: "button",
      textContent: "Choose a file",
      onclick: () => file.click(),
    }),
    element("button", {
      type: "button",
      textContent: "Choose a folder",
      onclick: () => folder.click(),
    }),
    file,
    folder,
  ];
}

/**
 * A form for the address of an image. The page is loaded again with that address in its own, so that the link can be
 * shared and the page's security policy allows reading from the host.
 */
function addressForm(): HTMLElement {
  const field = element(
    "input",
    {
      type: "url",
      placeholder: "https://host/image.ome.zarr",
      required: true,
      ariaLabel: "Address of an OME-Zarr image",
    },
    { sourceAddress: "" },
  );
  const show = element("button", { type: "submit", textContent: "Show" });
  const form = element("form", {}, {}, field, show);
  form.onsubmit = (event) => {
    event.preventDefault(); // the page's security policy forbids sending forms
    const address = new URL(location.href);
    address.searchParams.set("source", field.value.trim());
    location.assign(address);
  };
  return form;
}

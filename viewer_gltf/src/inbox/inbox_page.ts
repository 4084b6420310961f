/** The page of the inbox: the items on the server, the uploads of this page, and the user's actions. */
import { arrange, element, setText } from "../dom/element";
import { type ActionName, isRead } from "./actions";
import { ask } from "./ask";
import { Card, titleOf } from "./card";
import { DropZone } from "./drop_zone";
import { type Dropped, filesOfHandles } from "./dropped_files";
import type { InboxState, Item } from "./inbox_state";
import { forgetHandles, keepHandles, keptItems, readableHandles } from "./kept_handles";
import { type Choices, RefusedError, type Server } from "./server";
import type { Understood } from "./understood";
import { Upload } from "./upload";
import { type NamedFile, UploadFiles } from "./upload_files";
import { deletionWords, refusalOf, stateName, wordsOf } from "./words";

/** Time without new bytes after which another page's upload counts as abandoned, ms. */
const MOVING_MS = 4000;

/** Facts on an item that this page remembers, because the server does not send them. */
type Memory = {
  card: Card;
  understood: Understood | null;
  /** Number of times that the server has read the item. */
  reading: number;
  /** The reading whose summary was last requested. */
  asked: number;
  isBusy: boolean;
  fault: string;
  /** The last state that was reported to screen readers. */
  announced: string;
  bytes: number;
  /** Time at which bytes last arrived, ms; 0: none have since this page opened. */
  moved_ms: number;
};

export class InboxPage {
  private state: InboxState | null = null;
  private readonly memories = new Map<string, Memory>();
  private readonly uploads = new Map<string, Upload>();
  /** Names of the files or folders that were dropped on this page, by item. */
  private readonly names = new Map<string, string>();
  private running: Promise<void> = Promise.resolve();
  private withHandles: ReadonlySet<string> = new Set();
  private readonly zone: DropZone;
  private readonly list = element("div", { className: "cards" });
  private readonly heading = element("h2", { textContent: "Images", tabIndex: -1 });
  private readonly empty = element("p", { className: "empty" });
  private readonly noAnswer = element("p", {
    className: "no-answer",
    role: "alert",
    textContent: "The server does not answer. This page keeps trying.",
    hidden: true,
  });
  private readonly aloud = element("p", { className: "aloud", role: "status" }, { aloud: "" });

  constructor(
    parent: HTMLElement,
    private readonly server: Server,
  ) {
    this.zone = new DropZone({
      files: (dropped) => void this.take(dropped),
      address: (address) => this.takeAddress(address),
    });
    this.zone.root.hidden = true;
    this.zone.listen(() => this.state?.mayUpload === true);
    const items = element(
      "section",
      { className: "items" },
      {},
      this.heading,
      this.empty,
      this.list,
    );
    items.ariaLabel = "Images";
    parent.replaceChildren(
      element("header", { className: "top" }, {}, topTitle()),
      this.noAnswer,
      element("main", {}, {}, this.zone.root, items),
      this.aloud,
    );
    this.empty.textContent = "Asking the server for its images.";
    void this.loadHandles();
    addEventListener("offline", () => this.eachUpload((upload) => upload.loseConnection()));
    addEventListener("online", () => this.eachUpload((upload) => upload.retryNow()));
    addEventListener("beforeunload", (event) => {
      if ([...this.uploads.values()].some((upload) => !upload.isOver)) event.preventDefault();
    });
  }

  /** @param state null: the server does not answer */
  update(state: InboxState | null): void {
    this.noAnswer.hidden = state !== null;
    if (state === null) return;
    this.state = state;
    this.render();
  }

  private async loadHandles(): Promise<void> {
    this.withHandles = new Set(await keptItems());
    this.render();
  }

  private eachUpload(act: (upload: Upload) => void): void {
    for (const upload of this.uploads.values()) act(upload);
  }

  // Files and addresses that users add

  private async take(dropped: Dropped): Promise<void> {
    try {
      const found = await dropped.files((count) =>
        this.zone.showText(`Listing the files: ${count} so far.`),
      );
      await this.begin(found, await dropped.handles);
    } catch (error) {
      this.zone.showText(faultOf(error, "The files can't be read. Drop them again."), true);
    }
  }

  private async begin(
    found: readonly NamedFile[],
    handles: readonly FileSystemHandle[],
  ): Promise<void> {
    const { state } = this;
    if (state === null) return;
    const files = new UploadFiles(found);
    const refusal = refusalOf(files.files.length, files.bytes, state.limits);
    if (refusal !== null) {
      this.zone.showText(refusal, true);
      return;
    }
    const { id, offset } = await this.server.begin(files);
    this.zone.showText("");
    const known = this.uploads.get(id);
    if (known !== undefined && !known.isOver) {
      this.zone.showText("These files are being uploaded already.");
      return;
    }
    this.names.set(id, nameOf(files));
    await keepHandles(id, handles);
    const upload = new Upload(id, files, offset, this.server, state.limits.piece, () =>
      this.render(),
    );
    this.uploads.set(id, upload);
    this.running = this.running.then(() => upload.run()).then(() => this.endUpload(upload));
    this.render();
  }

  private async endUpload({ id, progress }: Upload): Promise<void> {
    if (progress.doing === "complete") await forgetHandles(id);
    await this.loadHandles();
  }

  /** Sends an address to the server. Returns whether the server has accepted it. */
  private async takeAddress(address: string): Promise<boolean> {
    this.zone.showText("Sending the address to the server.");
    try {
      await this.server.addAddress(address);
      this.zone.showText("");
      return true;
    } catch (error) {
      this.zone.showText(
        faultOf(error, "The address could not be sent to the server. Try again."),
        true,
      );
      return false;
    }
  }

  // The actions on an item

  private async act(item: Item, action: ActionName, keepsUpload: boolean): Promise<void> {
    if (action === "retry") this.uploads.get(item.id)?.retryNow();
    else if (action === "delete") await this.remove(item);
    else if (action === "look") await this.look(item);
    else if (action === "go-on") await this.busy(item, () => this.goOn(item));
    else if (action === "build")
      await this.busy(item, () => this.server.build(item.id, keepsUpload));
    else if (action !== "open") await this.busy(item, () => this.server.command(item.id, action));
  }

  /** Opens the view in another tab, because uploads end when this page is left. */
  private async look(item: Item): Promise<void> {
    const tab = open("about:blank", "_blank"); // a tab that is opened later would be blocked as a pop-up
    if (tab !== null) {
      tab.document.title = "Preview · StereoCell";
      tab.document.body.textContent = "The preview is being prepared.";
    }
    await this.busy(item, async () => {
      try {
        const page = new URL(await this.server.look(item.id), location.href).href;
        tab?.location.replace(page);
      } catch (error) {
        tab?.close();
        throw error;
      }
    });
  }

  private async remove(item: Item): Promise<void> {
    const title = titleOf(item, this.names.get(item.id) ?? "");
    if (!(await ask(`Delete "${title}"?`, deletionWords(item), "Delete"))) return;
    this.uploads.get(item.id)?.cancel();
    const isGone = await this.busy(item, () => this.server.remove(item.id));
    if (!isGone) return;
    await forgetHandles(item.id);
    this.heading.focus(); // the focus would be lost with the deleted card
  }

  private async goOn(item: Item): Promise<void> {
    const handles = await readableHandles(item.id);
    if (handles.length === 0) {
      throw new RefusedError(
        0,
        "The browser does not let this page read the files. Drop them again.",
      );
    }
    await this.begin(await filesOfHandles(handles, () => undefined), handles);
  }

  private async choose(item: Item, choices: Choices): Promise<void> {
    const memory = this.memoryOf(item);
    if (await this.busy(item, () => this.server.choose(item.id, choices))) memory.reading++;
    this.render();
  }

  /** Runs a request while the buttons of the item are disabled. Returns whether the request has succeeded. */
  private async busy(item: Item, request: () => Promise<void>): Promise<boolean> {
    const memory = this.memoryOf(item);
    memory.isBusy = true;
    memory.fault = "";
    this.render();
    try {
      await request();
      return true;
    } catch (error) {
      memory.fault = faultOf(error, "The files can't be read. Drop them again.");
      return false;
    } finally {
      memory.isBusy = false;
      this.render();
    }
  }

  // The cards and the list

  private memoryOf({ id, bytes }: Item): Memory {
    let memory = this.memories.get(id);
    if (memory === undefined) {
      const card = new Card(id, {
        act: (item, action, keeps) => void this.act(item, action, keeps),
        choose: (item, choices) => void this.choose(item, choices),
      });
      const start = {
        understood: null,
        reading: 0,
        asked: -1,
        isBusy: false,
        fault: "",
        announced: "",
      };
      memory = { card, ...start, bytes, moved_ms: 0 };
      this.memories.set(id, memory);
    }
    return memory;
  }

  private render(): void {
    const { state } = this;
    if (state === null) return;
    this.zone.root.hidden = !state.mayUpload;
    document.documentElement.dataset.may = state.mayUpload ? "upload" : "look";
    this.empty.hidden = state.items.length > 0;
    setText(
      this.empty,
      state.mayUpload
        ? "There are no images yet. Images that you drop appear here."
        : "There are no images yet. Images appear here once somebody has uploaded them.",
    );
    const newestFirst = state.items.toReversed();
    arrange(
      this.list,
      newestFirst.map((item) => this.show(item, state)),
    );
    const ids = new Set(state.items.map(({ id }) => id));
    for (const id of this.memories.keys()) if (!ids.has(id)) this.memories.delete(id);
  }

  private show(found: Item, { limits, mayUpload }: InboxState): HTMLElement {
    const memory = this.memoryOf(found);
    const item = { ...found, allTiles: found.allTiles || memory.understood?.tiles || 0 };
    const upload = this.progressOf(item);
    if (item.bytes > memory.bytes) memory.moved_ms = performance.now();
    memory.bytes = item.bytes;
    if (item.doing === "understanding") memory.reading = memory.asked + 1;
    if (isRead(item) && memory.asked < memory.reading) void this.loadSummary(item, memory);
    const isMoving = memory.moved_ms > 0 && performance.now() - memory.moved_ms < MOVING_MS;
    const { understood, isBusy, fault, reading } = memory;
    const ownName = this.names.get(item.id) ?? "";
    const situation = {
      upload,
      mayUpload,
      isMoving: isMoving && upload === null,
      hasHandles: this.withHandles.has(item.id),
      isUnderstood: understood !== null,
    };
    memory.card.update({ item, situation, understood, limits, ownName, isBusy, fault, reading });
    const words = wordsOf(item, upload, situation.isMoving, limits);
    const state = stateName(item, upload, situation.isMoving);
    this.announce(item, memory, state, `${titleOf(item, ownName)}: ${words}`);
    return memory.card.root;
  }

  private progressOf({ id, doing }: Item) {
    const upload = this.uploads.get(id);
    return doing !== "uploading" || upload === undefined ? null : upload.progress;
  }

  /** Fetches the summary of an item. */
  private async loadSummary(item: Item, memory: Memory): Promise<void> {
    memory.asked = memory.reading;
    try {
      memory.understood = await this.server.understood(item.id);
    } catch (error) {
      if (!(error instanceof RefusedError)) throw error; // the server has no summary of an image that it could not read
    }
    this.render();
  }

  /** Reports a new state to screen readers, but not each step of its progress. */
  private announce(item: Item, memory: Memory, state: string, words: string): void {
    if (state === memory.announced) return;
    const isFirst = memory.announced === "";
    memory.announced = state;
    if (!isFirst || item.doing === "uploading") setText(this.aloud, words);
  }
}

/** Returns the name of the dropped folder or file; if there are several, of the first one, and how many more there are. */
function nameOf({ files }: UploadFiles): string {
  const tops = [...new Set(files.map(({ name }) => name.split("/")[0]))];
  return tops.length === 1 ? tops[0] : `${tops[0]} and ${tops.length - 1} more`;
}

function topTitle(): HTMLElement {
  const product = element("small", { textContent: "StereoCell" });
  return element("h1", { textContent: "Inbox " }, {}, product);
}

function faultOf(error: unknown, otherwise: string): string {
  if (error instanceof RefusedError) return error.message;
  if (error instanceof DOMException) return otherwise;
  throw error;
}

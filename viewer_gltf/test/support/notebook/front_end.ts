/**
 * The notebook's side of a widget, like anywidget's front end: a model with `get`, `set`,
 * `save_changes`, `on`, `off` and `send`, and the module of the widget.
 */
import { readFile } from "node:fs/promises";
import type { Frame, Page } from "playwright-core";
import { Host } from "../browser/host";
import type { Kernel, Message } from "./kernel";

const NOTEBOOK = new URL("../../../../pipeline/stereocell/notebook/", import.meta.url);

type Callback = (...values: unknown[]) => void;
type State = Record<string, unknown>;
/** Members of the page's window. */
type Given = {
  toKernel: (message: string) => void;
  hear: (message: Message) => void;
  model: unknown;
  widget: { render: (given: unknown) => () => void };
  leave: () => void;
};

/** Runs in the page. */
function listen(): void {
  const given = window as unknown as Given;
  const bytes = (text: string) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const text = (buffer: ArrayBuffer) => {
    let all = "";
    for (const byte of new Uint8Array(buffer)) all += String.fromCharCode(byte);
    return btoa(all);
  };
  const state: State = {};
  const callbacks = new Map<string, Set<Callback>>();
  const changed = new Set<string>();
  const call = (event: string, ...values: unknown[]) => {
    for (const each of callbacks.get(event) ?? []) each(...values);
  };
  const send = (data: unknown, buffers: readonly ArrayBuffer[]) => {
    given.toKernel(JSON.stringify({ data, buffers: buffers.map(text) }));
  };
  given.model = {
    get: (name: string) => state[name],
    set(name: string, value: unknown) {
      if (JSON.stringify(state[name]) === JSON.stringify(value)) return;
      state[name] = value;
      changed.add(name);
      call(`change:${name}`);
    },
    save_changes() {
      const values = Object.fromEntries([...changed].map((name) => [name, state[name]]));
      changed.clear();
      send({ method: "update", state: values, buffer_paths: [] }, []);
    },
    on: (event: string, then: Callback) =>
      callbacks.set(event, (callbacks.get(event) ?? new Set()).add(then)),
    off: (event: string, then: Callback) => callbacks.get(event)?.delete(then),
    send: (content: unknown, _: unknown, buffers: readonly ArrayBuffer[] = []) =>
      send({ method: "custom", content }, buffers),
  };
  given.hear = (message) => {
    const data = message.data as {
      method?: string;
      content?: unknown;
      state?: State;
      buffer_paths?: string[][];
    };
    const views = message.buffers.map((one) => new DataView(bytes(one).buffer));
    if (data.method === "custom") return call("msg:custom", data.content, views);
    const values = { ...data.state };
    for (const [i, [name]] of (data.buffer_paths ?? []).entries()) values[name] = views[i];
    for (const [name, value] of Object.entries(values)) {
      state[name] = value;
      call(`change:${name}`);
    }
  };
}

export type Surroundings = Readonly<{
  /** Headers that the notebook's server sends with its pages. */
  headers?: Readonly<Record<string, string>>;
  /** Whether the output is a frame of another host, as in Colab and VS Code. */
  isForeign?: boolean;
}>;

/** A page that contains the widget. */
export class FrontEnd {
  private constructor(
    private readonly hosts: readonly Host[],
    readonly page: Page,
    /** Frame of the output. */
    readonly cell: Frame,
  ) {}

  /** All requests that reached the hosts of the notebook. */
  get requests(): readonly string[] {
    return this.hosts.flatMap(({ requests }) => requests.map(({ path }) => path));
  }

  static async open(
    page: Page,
    kernel: Kernel,
    { headers = {}, isForeign = false }: Surroundings = {},
  ): Promise<FrontEnd> {
    const host = await Host.start({ "/": NOTEBOOK.pathname });
    const outer = await Host.start({ "/": NOTEBOOK.pathname });
    host.headers = headers;
    const style = await readFile(new URL("widget.css", NOTEBOOK), "utf8");
    const pages = {
      "/cell.html": `<!doctype html><link rel="stylesheet" href="cell.css"><div id="cell"></div><div id="below"><img alt="" src="data:,"></div>
        <script type="module" src="listen.js"></script>`,
      "/cell.css": style,
      "/listen.js": `import widget from "./widget.js"; window.widget = widget; (${listen})();`,
    };
    for (const [path, body] of Object.entries(pages))
      host.overrides.set(path, { status: 200, body });
    const cellAddress = `${host.address}/cell.html`;
    const around = `<iframe src="${cellAddress}" width="600" height="280"></iframe>`;
    outer.overrides.set("/outer.html", { status: 200, body: around });
    await page.exposeFunction("toKernel", (message: string) => kernel.receive(JSON.parse(message)));
    await page.goto(isForeign ? `${outer.address}/outer.html` : cellAddress);
    const inner = isForeign ? await page.waitForSelector("iframe") : null;
    const cell = (await inner?.contentFrame()) ?? page.mainFrame();
    await cell.waitForFunction(() => "hear" in window);
    let order = Promise.resolve();
    kernel.onMessage = (message) => {
      const deliver = () =>
        cell.evaluate((values) => (window as unknown as Given).hear(values), message);
      order = order.then(deliver).catch(() => undefined); // the page has been closed
    };
    for (const message of [await kernel.opened, ...kernel.sent]) kernel.onMessage(message);
    await order;
    const front = new FrontEnd([host, outer], page, cell);
    await front.show();
    return front;
  }

  /** Removes the output. */
  async leave(): Promise<void> {
    await this.cell.evaluate(() => (window as unknown as Given).leave());
  }

  async show(): Promise<void> {
    await this.cell.evaluate(() => {
      const given = window as unknown as Given;
      const el = document.getElementById("cell");
      given.leave = given.widget.render({ model: given.model, el });
    });
  }

  /** Returns the frame of the viewer, once it shows the specimen. */
  async viewer(): Promise<Frame> {
    await this.cell.waitForSelector('.stereocell[data-state="live"]', { timeout: 90_000 });
    const frame = this.page.frames().find((each) => each.url() === "about:srcdoc");
    if (frame === undefined) throw new Error("no frame");
    return frame;
  }

  async stop(): Promise<void> {
    await this.page.close();
    await Promise.all(this.hosts.map((host) => host.stop()));
  }
}

/**
 * Firefox on a virtual screen, controlled by its protocol Marionette: JSON messages over TCP, each
 * after its length.
 */
import { type ChildProcess, spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { connect, createServer, type Socket } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";

const FIREFOX = [process.env.FIREFOX, "/usr/bin/firefox", "/usr/bin/firefox-esr"].find(isThere);
/** A virtual screen, without which Firefox has no WebGL. */
const SCREEN = ["/usr/bin/Xvfb"].find(isThere);
export const HOW_TO_GET_FIREFOX =
  "no Firefox, or no screen for it: apt-get install firefox-esr xvfb, or set FIREFOX to its path";
const START_MS = 60_000;
/** Longest duration of a script in the page, ms. */
const SCRIPT_MS = 120_000;

export const hasFirefox = FIREFOX !== undefined && SCREEN !== undefined;

function isThere(place: string | undefined): boolean {
  return place !== undefined && existsSync(place);
}

type Answer = readonly [
  type: number,
  id: number,
  error: { message: string } | null,
  value: unknown,
];

export class Firefox {
  private id = 0;
  private waiting = new Map<number, (answer: Answer) => void>();
  private rest = Buffer.alloc(0);

  private constructor(
    private readonly children: readonly ChildProcess[],
    private readonly profile: string,
    private readonly socket: Socket,
  ) {
    socket.on("data", (part) => this.take(part));
  }

  /** Starts a browser with a profile of its own, which is deleted when it stops. */
  static async start(): Promise<Firefox> {
    if (FIREFOX === undefined || SCREEN === undefined) throw new Error(HOW_TO_GET_FIREFOX);
    const profile = await mkdtemp(join(tmpdir(), "stereocell-firefox-"));
    const port = await freePort();
    const settings = { "marionette.port": port, "webgl.force-enabled": true };
    const lines = Object.entries(settings).map(
      ([name, value]) => `user_pref("${name}", ${value});`,
    );
    await writeFile(join(profile, "user.js"), lines.join("\n"));
    const { screen, display } = await startScreen(SCREEN);
    const size = ["--width", "560", "--height", "480"]; // small, because software draws
    const words = ["--marionette", "--no-remote", "--profile", profile, ...size];
    const env = { ...process.env, DISPLAY: display, HOME: profile, LIBGL_ALWAYS_SOFTWARE: "1" };
    const child = spawn(FIREFOX, words, { stdio: "ignore", env });
    const socket = await reach(port, Date.now() + START_MS);
    const firefox = new Firefox([child, screen], profile, socket);
    await firefox.send("WebDriver:NewSession", {});
    await firefox.send("WebDriver:SetTimeouts", { script: SCRIPT_MS });
    return firefox;
  }

  async open(url: string): Promise<void> {
    await this.send("WebDriver:Navigate", { url });
  }

  /** Returns the value of a script in the page, whose last argument is `resolve`. */
  async run(script: string): Promise<unknown> {
    const answer = await this.send("WebDriver:ExecuteAsyncScript", { script, args: [] });
    return (answer as { value: unknown }).value;
  }

  async screenshot(): Promise<Buffer> {
    const answer = await this.send("WebDriver:TakeScreenshot", { full: false });
    return Buffer.from((answer as { value: string }).value, "base64");
  }

  async stop(): Promise<void> {
    this.socket.destroy();
    for (const child of this.children) {
      const ended = new Promise((resolve) => child.once("exit", resolve));
      child.kill();
      await ended;
    }
    await rm(this.profile, { recursive: true, force: true });
  }

  private send(command: string, options: object): Promise<unknown> {
    const id = ++this.id;
    const text = JSON.stringify([0, id, command, options]);
    return new Promise((resolve, reject) => {
      this.waiting.set(id, ([, , error, value]) =>
        error === null ? resolve(value) : reject(new Error(`${command}: ${error.message}`)),
      );
      this.socket.write(`${Buffer.byteLength(text)}:${text}`);
    });
  }

  private take(part: Buffer): void {
    this.rest = Buffer.concat([this.rest, part]);
    for (;;) {
      const colon = this.rest.indexOf(":");
      const start = colon + 1;
      const length = Number(this.rest.subarray(0, Math.max(0, colon)));
      if (colon === -1 || this.rest.length < start + length) return;
      const message = JSON.parse(this.rest.subarray(start, start + length).toString());
      this.rest = this.rest.subarray(start + length);
      if (!Array.isArray(message)) continue; // the greeting of the browser
      const answer = message as unknown as Answer;
      this.waiting.get(answer[1])?.(answer);
      this.waiting.delete(answer[1]);
    }
  }
}

/** Starts a virtual screen. The program writes the name of the screen to its third stream. */
async function startScreen(program: string) {
  const words = ["-displayfd", "3", "-screen", "0", "1280x800x24", "-nolisten", "tcp"];
  const screen = spawn(program, words, { stdio: ["ignore", "ignore", "ignore", "pipe"] });
  const name = await new Promise<string>((resolve, reject) => {
    screen.stdio[3]?.once("data", (text) => resolve(String(text).trim()));
    screen.once("exit", () => reject(new Error(`${program} has ended`)));
  });
  return { screen, display: `:${name}` };
}

function freePort(): Promise<number> {
  return new Promise((resolve) => {
    const server = createServer().listen(0, "127.0.0.1", () => {
      const address = server.address();
      server.close(() => resolve(typeof address === "object" && address ? address.port : 0));
    });
  });
}

async function reach(port: number, until_ms: number): Promise<Socket> {
  for (;;) {
    const socket = await new Promise<Socket | null>((resolve) => {
      const made = connect(port, "127.0.0.1", () => resolve(made));
      made.once("error", () => resolve(null));
    });
    if (socket !== null) return socket;
    if (Date.now() > until_ms) throw new Error("Firefox does not answer");
    await new Promise((resolve) => setTimeout(resolve, 200));
  }
}

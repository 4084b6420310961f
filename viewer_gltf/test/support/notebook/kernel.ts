/** The widget in Python without a notebook (tests/support/widget_host.py). */
import { type ChildProcess, spawn } from "node:child_process";
import { join } from "node:path";
import { createInterface } from "node:readline";

const REPOSITORY = new URL("../../../../", import.meta.url).pathname;
const PYTHON = process.env.STEREOCELL_PYTHON ?? join(REPOSITORY, ".venv/bin/python");

/** A message as it is sent; buffers are in base64. */
export type Message = Readonly<{ type: string; data: unknown; buffers: readonly string[] }>;

type Answer = Readonly<{ answer?: unknown; fault?: string }>;

export class Kernel {
  /** First message of the widget: its state. */
  readonly opened: Promise<Message>;
  /** Later changes of the state, for a page that opens afterwards. */
  readonly sent: Message[] = [];
  /** All messages of the page. */
  readonly received: string[] = [];
  /** Number of messages in both directions. */
  messageCount = 0;
  onMessage: (message: Message) => void = () => undefined;
  private readonly answers: ((message: Answer) => void)[] = [];
  private readonly child: ChildProcess;

  constructor(bundle: string) {
    const env = { ...process.env, PYTHONPATH: join(REPOSITORY, "tests") };
    this.child = spawn(PYTHON, ["-m", "support.widget_host", bundle], {
      env,
      stdio: ["pipe", "pipe", "inherit"],
    });
    const { stdout } = this.child;
    if (stdout === null) throw new Error("no pipe");
    const lines = createInterface({ input: stdout });
    this.opened = new Promise((resolve) => {
      lines.on("line", (line) => {
        const message = JSON.parse(line);
        if ("answer" in message || "fault" in message) this.answers.shift()?.(message);
        else if (message.type === "comm_open") resolve(message);
        else {
          if (message.data.method === "update") this.sent.push(message);
          this.messageCount++;
          this.onMessage(message);
        }
      });
    });
  }

  /** Passes a message of the page to Python. */
  receive(message: unknown): void {
    this.messageCount++;
    this.received.push(JSON.stringify(message));
    this.write(message);
  }

  private write(message: unknown): void {
    this.child.stdin?.write(`${JSON.stringify(message)}\n`);
  }

  /** Runs a statement in Python, with the widget as `viewer`. */
  run(statement: string): void {
    this.write({ run: statement });
  }

  /** Returns the value of an expression in Python. */
  ask<T>(expression: string): Promise<T> {
    return new Promise((resolve, reject) => {
      this.answers.push(({ answer, fault }) => {
        if (fault === undefined) resolve(answer as T);
        else reject(new Error(fault));
      });
      this.write({ ask: expression });
    });
  }

  stop(): void {
    this.child.kill();
  }
}

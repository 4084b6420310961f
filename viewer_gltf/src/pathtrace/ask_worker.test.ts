import { expect, it } from "vitest";
import { askWorker } from "./ask_worker";

/** Answers each question by its ID, the newest first, and lists the listeners. */
class Echo extends EventTarget {
  heard: string[] = [];
  private waiting: { id: number }[] = [];

  postMessage(message: unknown): void {
    this.waiting.push(message as { id: number });
  }

  answer(): void {
    for (const { id } of this.waiting.splice(0).reverse()) {
      this.dispatchEvent(new MessageEvent("message", { data: { id, text: `answer ${id}` } }));
    }
  }

  override addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject | null,
    options?: AddEventListenerOptions | boolean,
  ): void {
    const counted = (event: Event) => {
      this.heard.push(type);
      if (typeof listener === "function") listener(event);
    };
    super.addEventListener(type, counted, options);
  }
}

const ask = (worker: Echo, id: number) =>
  askWorker<{ id: number; text: string }>(worker, { id }, [], "nothing was put together");

it("each question to a worker gets its own answer, in any order of the answers", async () => {
  const worker = new Echo();
  const asked = [1, 2].map((id) => ask(worker, id));
  worker.answer();
  expect((await Promise.all(asked)).map(({ text }) => text)).toEqual(["answer 1", "answer 2"]);
});

it("a question to a worker leaves no listener after an answer or a failure", async () => {
  const worker = new Echo();
  const asked = ask(worker, 1);
  worker.answer();
  await asked;
  const failing = ask(worker, 2);
  worker.dispatchEvent(new Event("error", { cancelable: true }));
  await expect(failing).rejects.toThrow("nothing was put together: no worker");
  worker.heard = [];
  for (const type of ["message", "error"]) worker.dispatchEvent(new Event(type));
  expect(worker.heard).toEqual([]);
});

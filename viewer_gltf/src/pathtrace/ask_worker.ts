/** One question to a worker that answers by number; nothing of it stays with the worker afterwards. */

/** The part of a worker that a question needs. */
export type Answering = Pick<EventTarget, "addEventListener"> &
  Readonly<{ postMessage: (message: unknown, options: StructuredSerializeOptions) => void }>;

/**
 * The answer to a question.
 *
 * @param transfer memory that goes to the worker with it
 * @param failure words before the worker's own fault
 */
export async function askWorker<Answer extends Readonly<{ id: number }>>(
  worker: Answering,
  question: Readonly<{ id: number }>,
  transfer: Transferable[],
  failure: string,
): Promise<Answer> {
  const answered = new AbortController();
  const { signal } = answered;
  try {
    return await new Promise<Answer>((resolve, reject) => {
      const hear = (event: Event) => {
        const { data } = event as MessageEvent<Answer>;
        if (data.id === question.id) resolve(data);
      };
      const fail = (event: Event) => {
        event.preventDefault();
        reject(new Error(`${failure}: ${(event as ErrorEvent).message || "no worker"}`));
      };
      worker.addEventListener("message", hear, { signal });
      worker.addEventListener("error", fail, { signal });
      worker.postMessage(question, { transfer });
    });
  } finally {
    answered.abort();
  }
}

/** Sends a question to a worker and waits for the answer with the same ID. All listeners are removed afterwards. */

/** The part of a worker that a question needs. */
export type Answering = Pick<EventTarget, "addEventListener"> &
  Readonly<{ postMessage: (message: unknown, options: StructuredSerializeOptions) => void }>;

/**
 * Returns the answer to a question. Throws if the worker fails.
 *
 * @param transfer memory that is transferred to the worker
 * @param failure text in front of the worker's own error message
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

/**
 * Runs jobs a few at a time, the cheapest first, so that each tile's overview precedes any detail.
 */
export class LoadQueue {
  private readonly waiting: { cost: number; start: () => void }[] = [];
  private running = 0;

  constructor(private readonly limit: number) {}

  /** Resolves with the job's result. A job that is aborted while it waits never starts. */
  add<T>(cost: number, signal: AbortSignal, job: () => Promise<T>): Promise<T> {
    return new Promise<T>((resolve, reject) => {
      const start = () => {
        if (signal.aborted) {
          reject(signal.reason);
          return;
        }
        this.running++;
        job()
          .then(resolve, reject)
          .finally(() => {
            this.running--;
            this.next();
          });
      };
      this.waiting.push({ cost, start });
      this.next();
    });
  }

  private next(): void {
    while (this.running < this.limit && this.waiting.length > 0) {
      this.waiting.sort((a, b) => b.cost - a.cost);
      this.waiting.pop()?.start();
    }
  }
}

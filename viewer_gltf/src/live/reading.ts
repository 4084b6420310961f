/**
 * Shows how much of a source the server has read, while the page waits for the first bundle of it.
 */

/** Name in the server timing of the page while the server is still reading the source: see `isReading`. */
const NAME = "stereocell-reading";
/** Pause between two requests for the progress, ms. */
const EACH_MS = 500;

/** Returns whether the server was reading a source when it sent this page. */
export function isReading(): boolean {
  const [page] = performance.getEntriesByType("navigation") as PerformanceNavigationTiming[];
  return page?.serverTiming?.some(({ name }) => name === NAME) === true;
}

/** Returns the text for a share, 0..1. */
export function wordsOfReading(share: number): string {
  return share < 1 ? `Reading the source: ${Math.floor(100 * share)} %` : "Opening the first view";
}

/** Shows how much has been read until the job is done, and returns the job's result. */
export async function whileReading<T>(
  root: string,
  job: Promise<T>,
  show: (words: string) => void,
): Promise<T> {
  let isDone = false;
  const watch = async () => {
    while (!isDone) {
      const share = await askShare(root);
      if (!isDone && share !== null) show(wordsOfReading(share));
      await new Promise((resolve) => setTimeout(resolve, EACH_MS));
    }
  };
  void watch();
  try {
    return await job;
  } finally {
    isDone = true;
  }
}

async function askShare(root: string): Promise<number | null> {
  try {
    const { share } = await (await fetch(new URL("/reading", root))).json();
    return typeof share === "number" ? share : null;
  } catch {
    return null; // the job itself reports that the server can't be reached
  }
}

/** CPU time of drawing, for benchmarks of software renderers. */
import type { CDPSession } from "playwright-core";

/**
 * Returns the CPU time that the browser's drawing process has used so far, s. The system counts
 * hundredths.
 *
 * @param session of the browser, not of a page
 */
export async function drawingProcess_s(session: CDPSession): Promise<number> {
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  const found = processInfo.find(({ type }) => type.toUpperCase() === "GPU");
  if (found === undefined) throw new Error("the browser has no process that draws");
  return found.cpuTime;
}

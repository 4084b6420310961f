/** Module worker: puts tiles together, off the thread that draws. See `medium_loader.ts`. */
import { type AssembleRequest, assemble } from "./assemble_tiles";

self.addEventListener("message", ({ data }: MessageEvent<AssembleRequest>) => {
  const made = assemble(data);
  self.postMessage(made, { transfer: [made.texels.buffer, ...made.bricks.map((b) => b.buffer)] });
});

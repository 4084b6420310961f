/** Module worker: what shades, off the thread that draws. See `shading_client.ts`. */
import { ShadingMaker, type ShadingRequest } from "./shading_maker";

const maker = new ShadingMaker();

self.addEventListener("message", ({ data }: MessageEvent<ShadingRequest>) => {
  const texels = maker.make(data);
  self.postMessage(texels, { transfer: [texels.buffer] });
});

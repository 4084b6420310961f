/** Module worker that computes shading away from the main thread. See `shading_client.ts`. */
import { ShadingMaker, type ShadingRequest } from "./shading_maker";

const maker = new ShadingMaker();

self.addEventListener("message", ({ data }: MessageEvent<ShadingRequest>) => {
  const texels = maker.make(data);
  self.postMessage(texels, { transfer: [texels.buffer] });
});

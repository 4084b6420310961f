/** Module worker: tables of skips, off the thread that draws. See `empty_space_client.ts`. */
import { type OccupancyRequest, occupancyDistances } from "../voxels/empty_space";

self.addEventListener("message", ({ data }: MessageEvent<OccupancyRequest>) => {
  const distances = occupancyDistances(data);
  self.postMessage(distances, { transfer: [distances.buffer] });
});

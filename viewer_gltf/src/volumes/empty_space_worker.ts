/**
 * Module worker that computes empty-space tables away from the main thread. See
 * `empty_space_client.ts`.
 */
import { type OccupancyRequest, occupancyDistances } from "../voxels/empty_space";

self.addEventListener("message", ({ data }: MessageEvent<OccupancyRequest>) => {
  const distances = occupancyDistances(data);
  self.postMessage(distances, { transfer: [distances.buffer] });
});

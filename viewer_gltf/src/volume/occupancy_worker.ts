/** Module worker: tables of leaps, off the thread that draws. See `occupancy_client.ts`. */
import { type OccupancyRequest, occupancyDistances } from "./occupancy";

self.addEventListener("message", ({ data }: MessageEvent<OccupancyRequest>) => {
  const distances = occupancyDistances(data);
  self.postMessage(distances, { transfer: [distances.buffer] });
});

/**
 * The text of the shader chunks that only the path tracer needs, in a file of their own because
 * they are loaded later.
 */
import { byName } from "./glsl_chunks";

export const PATH_TRACE_CHUNKS = byName(
  import.meta.glob(
    [
      "./chunks/{delta_tracking,environment,medium,medium_2d,phase_function}.glsl",
      "./chunks/{calibrated_light,random,reproject_search,temporal_history,tone_map}.glsl",
    ],
    { query: "?raw", import: "default", eager: true },
  ),
);

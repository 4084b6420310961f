/** The text of the shader chunks, by the name used in `#include`. */

/** @param files by path below this folder */
export function byName(files: Record<string, string>): Readonly<Record<string, string>> {
  return Object.fromEntries(
    Object.entries(files).map(([path, text]) => [path.slice(2, -".glsl".length), text]),
  );
}

/**
 * Chunks for ray marching and compositing. The path tracer's chunks are loaded with the path
 * tracer.
 */
export const CHUNKS = byName(
  import.meta.glob(
    [
      "./chunks/*.glsl",
      "!./chunks/{delta_tracking,environment,medium,medium_2d,phase_function}.glsl",
      "!./chunks/{calibrated_light,random,reproject_search,temporal_history,tone_map}.glsl",
    ],
    { query: "?raw", import: "default", eager: true },
  ),
);

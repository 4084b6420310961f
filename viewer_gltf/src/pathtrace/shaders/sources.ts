/** The source of the path tracer's shaders, in its own file because not all users need it. */

import { CHUNKS } from "../../gpu/glsl_chunks";
import { includeChunks } from "../../gpu/glsl_include";
import { PATH_TRACE_CHUNKS } from "../../gpu/path_trace_chunks";
import denoise from "./denoise.frag.glsl?raw";
import probe from "./light_probe.frag.glsl?raw";
import mean from "./mean.frag.glsl?raw";
import trace from "./path_trace.frag.glsl?raw";
import warp from "./reproject.frag.glsl?raw";
import show from "./tone_map.frag.glsl?raw";
import noise from "./variance.frag.glsl?raw";

const ALL = { ...CHUNKS, ...PATH_TRACE_CHUNKS };

export const TRACE_FRAGMENT = includeChunks(trace, ALL);
export const TRACE_NOISE = noise;
export const TRACE_PROBE = probe;
export const TRACE_MEAN = mean;
export const TRACE_DENOISE = denoise;
export const TRACE_WARP = includeChunks(warp, ALL);
export const TRACE_SHOW = includeChunks(show, ALL);

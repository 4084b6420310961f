/** The text of the path tracer's shaders: apart, as not everybody needs them. */
import { includeChunks } from "./include";
import { CHUNKS } from "./texts";
import trace from "./trace.frag.glsl?raw";
import denoise from "./trace_denoise.frag.glsl?raw";
import mean from "./trace_mean.frag.glsl?raw";
import noise from "./trace_noise.frag.glsl?raw";
import show from "./trace_show.frag.glsl?raw";
import warp from "./trace_warp.frag.glsl?raw";

export const TRACE_FRAGMENT = includeChunks(trace, CHUNKS);
export const TRACE_NOISE = noise;
export const TRACE_MEAN = mean;
export const TRACE_DENOISE = denoise;
export const TRACE_WARP = includeChunks(warp, CHUNKS);
export const TRACE_SHOW = includeChunks(show, CHUNKS);

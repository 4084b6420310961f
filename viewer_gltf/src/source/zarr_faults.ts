/** Faults that zarrita finds, as sentences that say who has to do what. */
import * as zarr from "zarrita";
import { SourceError } from "./source_error";

/** The job's result. Each fault that zarrita finds becomes a sentence that says who has to do what. */
export async function explained<T>(where: string, job: () => Promise<T>): Promise<T> {
  try {
    return await job();
  } catch (error) {
    if (error instanceof SourceError) throw error;
    const text = faultOf(error);
    if (text === null) throw error;
    throw new SourceError(`${where}: ${text}`, { cause: error });
  }
}

/** Whether there is no Zarr at an address. */
export function isNothingFound(error: unknown): boolean {
  return error instanceof SourceError && zarr.isZarritaError(error.cause, "NotFoundError");
}

function faultOf(error: unknown): string | null {
  if (zarr.isZarritaError(error, "NotFoundError")) {
    return (
      "found neither zarr.json nor the metadata of Zarr v2, expected an OME-Zarr image: check the address, or ask " +
      "whoever runs the host whether the image is public."
    );
  }
  if (zarr.isZarritaError(error, "UnknownCodecError")) {
    return (
      `the voxels are packed by ${error.codec}, which no browser unpacks: whoever made the image has to write it with ` +
      "blosc, zstd, gzip or lz4, or open it by: stereocell view"
    );
  }
  if (zarr.isZarritaError(error, "CodecPipelineError")) {
    return `a chunk can't be unpacked by ${error.codec}: whoever made the image has to write it again.`;
  }
  if (zarr.isZarritaError(error)) {
    return `${error.message}: whoever made the image has to correct its metadata.`;
  }
  if (error instanceof SyntaxError) {
    return "its metadata are no JSON: whoever made the image has to correct them.";
  }
  return null;
}

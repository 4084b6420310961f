/** Turns the errors of zarrita into sentences that name the remedy. */
import * as zarr from "zarrita";
import { SourceError } from "./source_error";

/** Runs a job and returns its result. Throws SourceError, with the remedy, for each error of zarrita. */
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

/** Returns whether an error means that there are no Zarr metadata at an address. */
export function isNothingFound(error: unknown): boolean {
  return error instanceof SourceError && zarr.isZarritaError(error.cause, "NotFoundError");
}

function faultOf(error: unknown): string | null {
  if (zarr.isZarritaError(error, "NotFoundError")) {
    return (
      "found neither zarr.json nor the metadata of Zarr v2, expected an OME-Zarr image: check the address, or ask " +
      "the operator of the host whether the image is public."
    );
  }
  if (zarr.isZarritaError(error, "UnknownCodecError")) {
    return (
      `found voxels packed by ${error.codec}, expected blosc, zstd, gzip or lz4: open the image with stereocell view, or ` +
      "ask its author for another codec."
    );
  }
  if (zarr.isZarritaError(error, "CodecPipelineError")) {
    return `found a chunk that ${error.codec} can't unpack: ask the author of the image to write it again.`;
  }
  if (zarr.isZarritaError(error)) {
    return `${error.message}: ask the author of the image to correct its metadata.`;
  }
  if (error instanceof SyntaxError) {
    return "found metadata that are not valid JSON: ask the author of the image to correct them.";
  }
  return null;
}

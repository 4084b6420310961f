import { BundleError } from "../bundle/errors";

/** A source can't be shown. The message is a sentence that names the remedy. */
export class SourceError extends BundleError {
  override readonly name = "SourceError";
}

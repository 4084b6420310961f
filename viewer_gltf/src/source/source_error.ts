import { BundleError } from "../bundle/errors";

/** A source that can't be shown. The message is one sentence that names who has to do what. */
export class SourceError extends BundleError {
  override readonly name = "SourceError";
}

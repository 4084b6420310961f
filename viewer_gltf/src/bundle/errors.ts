/** A fault of a bundle or of this browser, with a message for users. Other errors are bugs. */
export class BundleError extends Error {
  override readonly name: string = "BundleError";
}

/** A file that the host does not have. */
export class MissingError extends BundleError {
  override readonly name = "MissingError";
}

/** A fault that may pass: no connection, or a busy host. */
export class TemporaryError extends BundleError {
  override readonly name = "TemporaryError";
  /** The page's notice, shown once for all files with the same fault. */
  readonly notice: string;

  constructor(message: string, { notice = message, ...options }: TemporaryErrorOptions = {}) {
    super(message, options);
    this.notice = notice;
  }
}

type TemporaryErrorOptions = ErrorOptions & Readonly<{ notice?: string }>;

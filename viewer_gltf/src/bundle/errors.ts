/** What is wrong with a bundle or with this browser, in words for the page. Other errors are bugs. */
export class BundleError extends Error {
  override readonly name = "BundleError";
}

/** Message for code that failed to load when it was first needed. */

export const NOT_LOADED =
  "This part of the page could not be loaded: check the connection and try again.";

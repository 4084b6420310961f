/** Words for code that loads when it is first needed. */

export const NOT_LOADED =
  "This part of the page could not be loaded: check the connection and try again.";

/** The text of every shader chunk, by the name that `#include` has. */

const files: Record<string, string> = import.meta.glob("./chunks/*.glsl", {
  query: "?raw",
  import: "default",
  eager: true,
});
export const CHUNKS = Object.fromEntries(
  Object.entries(files).map(([path, text]) => [path.slice(2, -".glsl".length), text]),
);

/** Inserts chunks into a shader's text. */

/** Replaces each `#include <name>` line by the chunk. Throws Error if a chunk is missing. */
export function includeChunks(source: string, chunks: Readonly<Record<string, string>>): string {
  return source.replace(/^[ \t]*#include <([\w/]+)>/gm, (_, name: string) => {
    const chunk = chunks[name];
    if (chunk === undefined) throw new Error(`there is no shader chunk "${name}"`);
    return chunk.trimEnd();
  });
}

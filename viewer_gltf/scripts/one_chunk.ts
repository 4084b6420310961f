/**
 * Puts the page's own code into one file, including modules that it shares with parts that load later. The build
 * compresses that file (finish_build.ts). A separate file for each shared module would need one more request before the
 * first frame.
 */
type Modules = Readonly<{
  getModuleInfo: (id: string) => Readonly<{ importedIds: readonly string[] }> | null;
}>;

/** Returns a module and all modules that it imports directly or indirectly, except by dynamic imports. */
export function reachOf(entry: string, modules: Modules): ReadonlySet<string> {
  const reach = new Set<string>();
  const waiting = [entry];
  for (let id = waiting.pop(); id !== undefined; id = waiting.pop()) {
    if (reach.has(id)) continue;
    reach.add(id);
    waiting.push(...(modules.getModuleInfo(id)?.importedIds ?? []));
  }
  return reach;
}

/** Returns a function that names the file for a module; null leaves the choice to the bundler. */
export function oneChunk(entry: string, name: string) {
  let reach: ReadonlySet<string> | null = null;
  return (id: string, modules: Modules): string | null => {
    reach ??= reachOf(entry, modules);
    return reach.has(id) ? name : null;
  };
}

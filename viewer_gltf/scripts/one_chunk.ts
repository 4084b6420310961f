/**
 * The page's own code in one file, whatever the parts that come later share with it: the build packs
 * that file (finish_build.ts), and a file for each shared module would be a request more before the first
 * picture.
 */
type Modules = Readonly<{
  getModuleInfo: (id: string) => Readonly<{ importedIds: readonly string[] }> | null;
}>;

/** All that a module imports, itself included, but for what it imports when it is wanted. */
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

/** The name of the file that a module goes to; null: the bundler's choice. */
export function oneChunk(entry: string, name: string) {
  let reach: ReadonlySet<string> | null = null;
  return (id: string, modules: Modules): string | null => {
    reach ??= reachOf(entry, modules);
    return reach.has(id) ? name : null;
  };
}

/**
 * The branch of a tileset that is removed when a tile fails, and put back when it is tried again.
 */
export type Branch<T> = {
  readonly parent: T | null;
  children?: T[];
  readonly internal: Readonly<{ hasUnrenderableContent: boolean }>;
};

/**
 * Returns the child of the next tile above that can draw something: the tile itself, or the holder
 * of the external tileset whose root it is. A holder draws nothing, so without its root it would be
 * a hole. A holder that was dropped from memory is loaded again later, so nothing may be put back
 * into it.
 */
export function branchOf<T extends Branch<T>>(tile: T): T {
  let branch = tile;
  while (branch.parent?.internal.hasUnrenderableContent) branch = branch.parent;
  return branch;
}

export function leaveOut<T extends Branch<T>>(branch: T): void {
  const { parent } = branch;
  if (parent?.children) parent.children = parent.children.filter((child) => child !== branch);
}

export function putBack<T extends Branch<T>>(branch: T): void {
  const siblings = branch.parent?.children;
  if (siblings !== undefined && !siblings.includes(branch)) siblings.push(branch);
}

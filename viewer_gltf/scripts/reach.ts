/**
 * Checks that a part uses members of the host, and does not reach through them: `host.viewpoint.lookFrom(view)` is
 * allowed, and `host.display.viewpoint.lookFrom(view)` is not. Destructuring counts as well:
 * `const { viewpoint } = host.display` has two dots, and `viewpoint.lookFrom(view)` after it adds the third.
 */
import { parseSync } from "vite";

/** Largest number of dots between the host and a member that a part uses. */
const MOST_DOTS = 2;
/** Members with plain data, which may be read to any depth. */
const PLAIN: ReadonlySet<string> = new Set([
  ...["bundle", "focus", "state"], // members of the host
  ...["facts", "ranges", "view"], // members of the panel
  ...["cameraView", "cameraPose"], // members of the viewpoint
]);
/** Types of parameters that are the host. */
const HOSTS: ReadonlySet<string> = new Set(["PartHost", "Host"]);

/** A node of the syntax tree of any kind. */
type Node = Readonly<{ type: string; start: number }> & Readonly<Record<string, unknown>>;
/** The names of the members from the host to a value; null if the value does not come from the host. */
type Path = readonly string[] | null;
/** A chain that is too long, and its line. */
export type Reach = Readonly<{ line: number; chain: string }>;

const isNode = (value: unknown): value is Node =>
  typeof value === "object" && value !== null && "type" in value;

function childrenOf(node: Node): readonly Node[] {
  return Object.values(node)
    .flatMap((value: unknown) => (Array.isArray(value) ? value : [value]))
    .filter(isNode);
}

/** The path of `this`, an object that has the host as its member `host`. */
const THIS: Path = ["this"];

function stepOf(path: Path, name: string): Path {
  if (path === THIS) return name === "host" ? [] : null;
  return path && [...path, name];
}

/** The names in a block and in the blocks around it, with their paths. */
class Scope {
  private readonly names = new Map<string, Path>();

  constructor(private readonly outer: Scope | null) {}

  find(name: string): Path {
    const found = this.names.get(name);
    if (found !== undefined) return found;
    return this.outer === null ? (name === "host" ? [] : null) : this.outer.find(name);
  }

  /** Stores the paths of the names in a destructuring pattern. */
  bind(pattern: Node, path: Path): void {
    if (pattern.type === "Identifier") this.names.set(String(pattern.name), path);
    else if (pattern.type === "AssignmentPattern") this.bind(pattern.left as Node, path);
    else if (pattern.type === "ObjectPattern") {
      for (const property of pattern.properties as readonly Node[]) {
        if (property.type !== "Property") continue; // a rest element is a new object, not a member of the host
        const name = String((property.key as Node).name);
        this.bind(property.value as Node, stepOf(path, name));
      }
    }
  }
}

/** Returns whether a parameter is declared as the host. */
function isHost(parameter: Node): boolean {
  const annotation = (parameter.typeAnnotation as Node | null)?.typeAnnotation as Node | undefined;
  return HOSTS.has(String((annotation?.typeName as Node | undefined)?.name));
}

/** Returns the path of an expression's value. */
function pathOf(node: Node, scope: Scope): Path {
  if (node.type === "ThisExpression") return THIS;
  if (node.type === "Identifier") return scope.find(String(node.name));
  if (node.type === "ChainExpression") return pathOf(node.expression as Node, scope);
  if (node.type !== "MemberExpression" || node.computed === true) return null;
  return stepOf(pathOf(node.object as Node, scope), String((node.property as Node).name));
}

/** Returns the number of dots of a path; all names from a member with plain data on count as one. */
function dotsOf(path: readonly string[]): number {
  const plain = path.findIndex((name) => PLAIN.has(name));
  return plain === -1 ? path.length : plain + 1;
}

/** Returns the chains of a file that reach through the host. */
export function reachesOf(file: string, text: string): readonly Reach[] {
  const found = new Map<number, Reach>();
  const note = (path: Path, { start }: Node) => {
    if (path === null || dotsOf(path) <= MOST_DOTS) return;
    const line = text.slice(0, start).split("\n").length;
    found.set(start, { line, chain: `host.${path.join(".")}` });
  };
  const visit = (node: Node, scope: Scope): void => {
    if (node.type === "VariableDeclarator" && isNode(node.init)) {
      visit(node.init, scope);
      const inner = pathOf(node.init, scope);
      scope.bind(node.id as Node, inner);
      noteNames(node.id as Node, scope);
      return;
    }
    if (node.type === "MemberExpression") {
      const path = pathOf(node, scope);
      note(path, node);
      if (path !== null) return; // the shorter chains within this one need no check
    }
    const isFunction = Array.isArray(node.params);
    const inner = isFunction || node.type === "BlockStatement" ? new Scope(scope) : scope;
    if (isFunction) {
      for (const parameter of node.params as readonly Node[]) {
        const isNamedHost = parameter.type === "Identifier" && parameter.name === "host";
        inner.bind(parameter, isHost(parameter) || isNamedHost ? [] : null);
        noteNames(parameter, inner);
      }
    }
    for (const child of childrenOf(node)) visit(child, inner);
  };
  const noteNames = (pattern: Node, scope: Scope): void => {
    if (pattern.type === "Identifier") note(scope.find(String(pattern.name)), pattern);
    for (const property of (pattern.properties ?? []) as readonly Node[]) {
      if (property.type === "Property") noteNames(property.value as Node, scope);
    }
  };
  visit(parseSync(file, text).program as unknown as Node, new Scope(null));
  return [...found.values()];
}

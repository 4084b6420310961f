/** The parts of a viewer. Each call of the host goes to all of them. */
import type { Object3D } from "three";
import type { Target } from "../interaction/ray_pointer";
import type { ClipPlane } from "../math/clip";
import type { Ray, Vec3 } from "../math/vec3";
import type { PanelView, PartSection } from "../panel/controls";
import { KeyTable, OWN_KEYS } from "../panel/keys";
import type { Remedies } from "../panel/remedies";
import type { Command } from "../state/commands";
import type { ViewerState } from "../state/viewer_state";
import type { Form } from "./form";
import type { CommandTable, FrameView, Hit, Part, PartDefinition, Tap } from "./part";
import type { Services } from "./services";

const LAST = Number.POSITIVE_INFINITY;

/**
 * Orders parts by rank, lowest first. Parts with a high rank use the services of those with a low
 * rank, and are updated after them.
 */
export function inOrder(definitions: readonly PartDefinition[]): readonly PartDefinition[] {
  const place = ({ rank = LAST }: PartDefinition) => rank;
  return definitions.toSorted((a, b) => (place(a) < place(b) ? -1 : Number(place(a) > place(b))));
}

/**
 * Passes each call of the host to all parts, in the order in which they were added.
 *
 * ```ts
 * import type { Part, PartDefinition } from "./part";
 * import { inOrder, Parts } from "./parts";
 *
 * const part = (id: string): Part => ({ id, isLoading: id === "volumes", dispose: () => undefined });
 * const definitions: readonly PartDefinition[] = [
 *   { id: "volumes", create: () => part("volumes") },
 *   { id: "surfaces", rank: 1, create: () => part("surfaces") },
 * ];
 * print(inOrder(definitions).map(({ id }) => id)); // ["surfaces","volumes"]
 * const parts = new Parts(definitions);
 * parts.add(part("surfaces"));
 * print(parts.isLoading); // false
 * parts.add(part("volumes"));
 * print(parts.isLoading); // true
 * ```
 */
export class Parts {
  readonly keys: KeyTable;
  readonly remedies: Remedies;
  private all: readonly Part[] = [];
  /** The newest state. A part may change the state while the parts are updated to an older one. */
  private newest: ViewerState | null = null;

  constructor(definitions: readonly PartDefinition[]) {
    this.keys = new KeyTable([...OWN_KEYS, ...definitions.flatMap(({ keys = [] }) => keys)]);
    this.remedies = Object.assign({}, ...definitions.map(({ remedies = {} }) => remedies));
  }

  add(part: Part): void {
    this.all = [...this.all, part];
  }

  begin(): void {
    for (const part of this.all) part.begin?.();
  }

  /** Resolves when all parts have finished their work after the opening. */
  async afterOpening(): Promise<void> {
    await Promise.all(this.all.map((part) => part.afterOpening?.()));
  }

  async afterOverview(): Promise<void> {
    await Promise.all(this.all.map((part) => part.afterOverview?.()));
  }

  sync(state: ViewerState, previous: ViewerState): void {
    this.newest = state;
    for (const part of this.all) {
      part.sync?.(state, previous);
      // a part has changed the state, and all parts have been updated to that state
      if (this.newest !== state) return;
    }
  }

  advance(frame: FrameView): void {
    for (const part of this.all) part.advance?.(frame);
  }

  /** The forms in which the specimen is drawn. */
  get forms(): readonly Form[] {
    return this.all.flatMap(({ form = [] }) => form);
  }

  get groups(): readonly Object3D[] {
    return this.scenes.map(({ group }) => group);
  }

  get overlays(): readonly Object3D[] {
    return this.scenes.flatMap(({ overlays }) => overlays);
  }

  get solid(): number {
    return this.scenes.reduce((sum, { solid }) => sum + solid, 0);
  }

  get hasStandingPart(): boolean {
    return this.scenes.some(({ isStanding }) => isStanding);
  }

  get targets(): readonly Target[] {
    return this.all.flatMap(({ targets = [] }) => targets);
  }

  get isLoading(): boolean {
    return this.all.some(({ isLoading = false }) => isLoading);
  }

  cutBefore(eye: Vec3): readonly ClipPlane[] | undefined {
    const cuts = this.all.map((part) => part.cutBefore?.(eye));
    return cuts.find((each) => each !== undefined);
  }

  /** Returns the nearest hit of a kind; null: none. */
  pick(ray: Ray, isWanted: (hit: Hit) => boolean): Hit | null {
    const hits = this.all.flatMap((part) => part.pick?.(ray) ?? []).filter(isWanted);
    if (hits.length === 0) return null;
    return hits.reduce((a, b) => (b.distance_um < a.distance_um ? b : a));
  }

  onTap(tap: Tap): void {
    for (const part of this.all) part.onTap?.(tap);
  }

  /** Passes a tap to the parts until one has used it. */
  tap(tap: Tap): "used" | "shared" | null {
    let answer: "shared" | null = null;
    for (const part of this.all) {
      const ofPart = part.tap?.(tap) ?? null;
      if (ofPart === "used") return "used";
      answer ??= ofPart;
    }
    return answer;
  }

  openCard(tap: Tap): void {
    for (const part of this.all) part.openCard?.(tap);
  }

  /** Runs a command; false: no part has it. @param isOnPage false: the panel in the scene has sent it */
  run(command: Command, isOnPage: boolean): boolean {
    const tables = this.all.flatMap(({ commands = {}, pageCommands = {} }): CommandTable[] =>
      isOnPage ? [commands, pageCommands] : [commands],
    );
    return tables.some((table) => {
      const run = table[command];
      return run !== undefined && run() !== false;
    });
  }

  sections(view: PanelView): readonly PartSection[] {
    return this.all.flatMap((part) => part.panel?.(view) ?? []);
  }

  service<K extends keyof Services>(name: K): Services[K] | null {
    for (const { services } of this.all) {
      const found = services?.[name];
      if (found !== undefined) return found;
    }
    return null;
  }

  retryFailed(): void {
    for (const part of this.all) part.retryFailed?.();
  }

  dispose(): void {
    for (const part of this.all) part.dispose();
  }

  private get scenes() {
    return this.all.flatMap(({ scene }) => scene ?? []);
  }
}

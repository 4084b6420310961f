/** The marches of the tiles whose texels have come. */
import { Group } from "three";
import { isTraced } from "../state/parameters/volumes";
import type { ViewerState } from "../state/viewer_state";
import { type Appearances, showsBelow } from "./appearances";
import type { Marched } from "./light/depth_shading";
import type { Residency, Resident } from "./residency";
import { SkipTables } from "./skip_tables";
import { type MarchFrame, TileMarch } from "./tile_raymarch";

export type MarchOptions = Readonly<{
  frame: MarchFrame;
  residents: Residency;
  appearances: Appearances;
  /** A tile shows values that its bricks leave out. */
  onBelow: (tile: string) => void;
  onChange: () => void;
}>;

export class MarchSet {
  readonly group = new Group();
  private readonly skips: SkipTables;

  constructor(private readonly options: MarchOptions) {
    this.skips = new SkipTables(options.onChange);
    this.group.matrixAutoUpdate = false;
  }

  get isLoading(): boolean {
    return this.skips.isLoading;
  }

  /** Whether anything is to be marched. */
  get isEmpty(): boolean {
    return !this.group.children.some(({ visible }) => visible);
  }

  /** Whether all that is marched shows in the disc alone. */
  get isInDisc(): boolean {
    const drawn = this.drawn;
    return drawn.length > 0 && drawn.every(({ march }) => march.isInDisc);
  }

  /** Whether of what is marched some shows in the disc alone, and some beyond it too. */
  get isPartlyInDisc(): boolean {
    return !this.isInDisc && this.drawn.some(({ march }) => march.isPartlyInDisc);
  }

  /** March what lies in the disc's cone alone, whatever the channels; false: as each shows. */
  endAtDisc(ends: boolean): void {
    for (const { march } of this.drawn) march.endAtDisc(ends);
  }

  get drawn(): readonly Marched[] {
    return this.options.residents.all.flatMap((resident) => {
      const { march, packed } = resident;
      return march?.mesh.visible && packed !== null ? [{ march, packed, resident }] : [];
    });
  }

  /** Makes a march for the texels that have come, in the colours of the state. */
  dress(resident: Resident, state: ViewerState): void {
    const { shown } = resident.texture;
    if (shown === null) {
      resident.march?.dispose();
      resident.march = null;
      resident.packed = null;
      return;
    }
    const appearances = shown.channels.map((id) => this.options.appearances.of(state, id));
    if (showsBelow(resident.texture, appearances)) {
      const [{ tile }] = [...resident.texture.kept.values()].map(({ volume }) => volume);
      this.options.onBelow(tile);
      return;
    }
    const isNewSet = resident.packed?.channels.join() !== shown.channels.join();
    const { march: before } = resident;
    let march = before;
    if (march === null || march.channelCount !== shown.channels.length) {
      before?.dispose();
      const volume = this.volumeOf(shown.channels[0], resident);
      march = new TileMarch(volume, shown.channels.length, this.options.frame);
      resident.march = march;
      this.group.add(march.mesh);
    }
    resident.packed = shown;
    march.composite(isTraced(state) ? "over" : state.compositing);
    const differs = march.setAppearances(appearances);
    if (!differs && !isNewSet && march === before) return;
    const { tile } = march.volume;
    const isCurrent = () => this.options.residents.get(tile)?.march === march;
    void this.skips.find(march, shown, appearances, isCurrent);
  }

  private volumeOf(channel: string, { texture }: Resident) {
    const source = texture.kept.get(channel);
    if (source === undefined) throw new Error(`channel ${channel} has come without a source`);
    return source.volume;
  }

  /** Shows each march as far as it has faded in. */
  showAll(): void {
    for (const resident of this.options.residents.all) this.show(resident);
  }

  private show({ march, texture, packed, presence }: Resident): void {
    if (march === null || packed === null) return;
    march.mesh.visible = presence > 0;
    march.show(packed, texture.old, texture.fresh, presence);
  }

  dispose(): void {
    this.skips.dispose();
  }
}

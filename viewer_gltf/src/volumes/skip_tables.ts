/** Tables by which a march skips over empty bricks; a worker computes them. */
import { OccupancyClient } from "./empty_space_client";
import { brickCounts } from "./skip_bricks";
import type { Appearance, TileMarch } from "./tile_raymarch";
import type { Packed } from "./tile_texture";
import { opacities } from "./transfer_luts";

export class SkipTables {
  private readonly occupancy = new OccupancyClient();
  /** Number of tables that are being computed. */
  private underWay = 0;

  constructor(private readonly onChange: () => void) {}

  get isLoading(): boolean {
    return this.underWay > 0;
  }

  /** @param isCurrent whether the march is still the one of its tile */
  async find(
    march: TileMarch,
    shown: Packed,
    appearances: readonly Appearance[],
    isCurrent: () => boolean,
  ): Promise<void> {
    march.skipBy(null); // a place that the old table skips over may show now
    this.underWay++;
    const distances = await this.occupancy
      .computeDistances(march.volume.tile, {
        bricks: shown.bricks,
        alphas: appearances.map(({ table }) => opacities(table)),
        count: brickCounts(march.volume.size),
      })
      .finally(() => {
        this.underWay--;
        this.onChange();
      });
    if (distances !== null && isCurrent()) march.skipBy(distances);
  }

  dispose(): void {
    this.occupancy.dispose();
  }
}

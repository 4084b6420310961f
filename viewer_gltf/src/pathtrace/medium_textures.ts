/** The textures that paths read: the medium by intensity, its majorants by brick, and the environment's light. */
import { type Data3DTexture, type DataTexture, RGBAFormat, RGFormat } from "three";
import { SKIP_BRICK } from "../bundle/generated/constants";
import { float3D, floatTexture } from "../gpu/float_targets";
import type { ScreenPass } from "../gpu/screen_pass";
import { brickCounts } from "../voxels/skip_bricks";
import { ENTRIES, edgeContrast } from "../voxels/transfer_luts";
import { tablesInto } from "../voxels/transfer_table_2d";
import type { EnvironmentTables } from "./environment_sampling";
import {
  coarserMajorants,
  type MediumAppearance,
  majorants,
  mediumTable,
  rowsOf,
} from "./extinction";
import type { MediumTexels } from "./medium_loader";
import type { TraceUniforms } from "./uniforms";

export class MediumTextures {
  private readonly medium = floatTexture(ENTRIES, 1, RGBAFormat);
  private majorants: Data3DTexture = float3D(new Float32Array(1), [1, 1, 1]);
  private environment: DataTexture = floatTexture(1, 1, RGBAFormat);
  private aliases: DataTexture = floatTexture(1, 1, RGFormat);

  /** @param brick edge of a brick of majorants in texels: SKIP_BRICK or a multiple of it */
  constructor(
    private readonly pass: ScreenPass<TraceUniforms>,
    private readonly brick: number,
  ) {}

  /**
   * @param appearances of the channels, in the order of the texture's channels
   * @param density factor to the extinction
   */
  setAppearances(
    { frame, bricks, size }: MediumTexels,
    appearances: readonly MediumAppearance[],
    density: number,
  ): void {
    const table = mediumTable(appearances, Math.min(...frame.spacing_um), density);
    const rows = rowsOf(appearances);
    this.medium.dispose();
    this.medium.image = { data: table, width: ENTRIES, height: rows * appearances.length };
    this.medium.needsUpdate = true;
    this.majorants.dispose();
    const fine = majorants(table, bricks);
    const coarse = coarserMajorants(fine, brickCounts(size), this.brick / SKIP_BRICK);
    this.majorants = float3D(coarse.majorants, coarse.counts);
    const { uniforms } = this.pass;
    this.pass.define("TWO_D", rows === 1 ? null : 1);
    tablesInto(
      uniforms,
      appearances.map(({ table2d }) => table2d),
    );
    uniforms.uMedium.value = this.medium;
    appearances.forEach((each, c) => {
      uniforms.uContrast.value.setComponent(c, edgeContrast(each.table));
    });
    uniforms.uMajorants.value = this.majorants;
    uniforms.uBrick.value.setScalar(this.brick);
  }

  lightBy({ width, height, light, aliases }: EnvironmentTables): void {
    this.environment.dispose();
    this.aliases.dispose();
    this.environment = floatTexture(width, height, RGBAFormat, light);
    this.aliases = floatTexture(width, height, RGFormat, aliases);
    this.pass.uniforms.uEnvironment.value = this.environment;
    this.pass.uniforms.uAliases.value = this.aliases;
  }

  dispose(): void {
    for (const each of [this.medium, this.majorants, this.environment, this.aliases]) {
      each.dispose();
    }
  }
}

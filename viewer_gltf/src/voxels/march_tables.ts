/** The colours and transfer functions of a tile's channels, as lookup tables for the march. */
import {
  DataArrayTexture,
  DataTexture,
  LinearFilter,
  RGBAFormat,
  UnsignedByteType,
  Vector3,
  Vector4,
} from "three";
import { COLUMNS, ROWS } from "../bundle/transfer_2d";
import type { Rgb } from "../math/color";
import { ENTRIES, edgeContrast, opacities } from "./transfer_luts";
import { alikeRows, type TransferTable2d, tablesInto, tableUniforms } from "./transfer_table_2d";

export type Appearance = Readonly<{
  color: Rgb;
  /** 256 RGBA entries from `lookUpTable`; with a 2D table, the visible part at any gradient. */
  table: Uint8Array;
  table2d?: TransferTable2d | null;
  /** Range of the intensities, 0 to 1, that is shown from dark to bright; absent: all. */
  window?: readonly [number, number];
  isInDisc: boolean;
}>;

const ALL = [0, 1] as const;

function emptyTables2d(channels: number): DataArrayTexture {
  const texture = new DataArrayTexture(
    new Uint8Array(channels * ROWS * COLUMNS * 4),
    COLUMNS,
    ROWS,
    channels,
  );
  texture.format = RGBAFormat;
  texture.type = UnsignedByteType;
  texture.minFilter = texture.magFilter = LinearFilter;
  return texture;
}

function makeUniforms(channels: number, lut: DataTexture) {
  return {
    uColor: { value: Array.from({ length: channels }, () => new Vector3()) },
    uInDisc: { value: [false, false, false, false] },
    uFloor: { value: new Vector4(1, 1, 1, 1) },
    uContrast: { value: new Vector4(1, 1, 1, 1) },
    uWindowLow: { value: new Vector4() },
    uWindowHigh: { value: new Vector4(1, 1, 1, 1) },
    uLut: { value: lut },
    uTables2d: { value: null as DataArrayTexture | null },
    ...tableUniforms(),
  };
}

export class MarchTables {
  readonly uniforms;
  private readonly lut: DataTexture;
  /**
   * The tables of value and gradient, one layer for each channel; null until a channel needs one.
   */
  private tables2d: DataArrayTexture | null = null;
  /** The content of each layer; null for a table without gradients. */
  private readonly layers: (Uint8Array | null)[] = [];
  private inDisc: readonly boolean[] = [];
  /** Whether any channel has a table of value and gradient. */
  isTwoD = false;
  changes = 0;

  constructor(private readonly channelCount: number) {
    const rows = new Uint8Array(channelCount * ENTRIES * 4);
    this.lut = new DataTexture(rows, ENTRIES, channelCount, RGBAFormat, UnsignedByteType);
    this.lut.minFilter = this.lut.magFilter = LinearFilter;
    this.uniforms = makeUniforms(channelCount, this.lut);
  }

  get isInDisc(): boolean {
    return this.inDisc.length > 0 && this.inDisc.every((is) => is);
  }

  get isPartlyInDisc(): boolean {
    return this.inDisc.includes(true);
  }

  /** The opacities of a channel's table, as it is drawn. */
  opacitiesOf(channel: number): Uint8Array {
    return opacities((this.lut.image.data as Uint8Array).subarray(channel * ENTRIES * 4));
  }

  /**
   * Takes over colours and tables, by uploading a few kilobytes. Returns whether other voxels may
   * be visible than before.
   */
  sync(appearances: readonly Appearance[]): boolean {
    const { uniforms } = this;
    const rows = this.lut.image.data as Uint8Array;
    let differs = false;
    appearances.forEach(({ color, table, isInDisc, window: [low, high] = ALL }, c) => {
      uniforms.uColor.value[c].set(...color);
      uniforms.uInDisc.value[c] = isInDisc;
      uniforms.uFloor.value.setComponent(c, floorOf(table));
      uniforms.uContrast.value.setComponent(c, edgeContrast(table));
      uniforms.uWindowLow.value.setComponent(c, low);
      uniforms.uWindowHigh.value.setComponent(c, high);
      const row = rows.subarray(c * table.length, (c + 1) * table.length);
      if (table.every((value, i) => value === row[i])) return;
      row.set(table);
      differs = true;
    });
    if (differs) {
      this.lut.needsUpdate = true;
      this.changes++;
    }
    this.inDisc = appearances.map(({ isInDisc }) => isInDisc);
    this.isTwoD = appearances.some(({ table2d }) => table2d != null);
    if (this.isTwoD) this.fillTables2d(appearances);
    return differs;
  }

  /**
   * If any channel has a table of value and gradient, all get one; the rows of the other channels
   * are equal.
   */
  private fillTables2d(appearances: readonly Appearance[]): void {
    const { uniforms } = this;
    this.tables2d ??= emptyTables2d(this.channelCount);
    const { tables2d } = this;
    uniforms.uTables2d.value = tables2d;
    const cells = tables2d.image.data as Uint8Array;
    const { length } = appearances[0].table;
    tablesInto(
      uniforms,
      appearances.map(({ table2d }) => table2d),
    );
    appearances.forEach(({ table, table2d }, c) => {
      const at = c * ROWS * length;
      const isThere =
        table2d != null
          ? this.layers[c] === table2d.cells
          : this.layers[c] === null && table.every((value, i) => value === cells[at + i]);
      if (isThere) return;
      cells.set(table2d?.cells ?? alikeRows(table), at);
      this.layers[c] = table2d?.cells ?? null;
      tables2d.addLayerUpdate(c); // the other layers stay on the GPU
      tables2d.needsUpdate = true;
    });
  }

  dispose(): void {
    this.lut.dispose();
    this.tables2d?.dispose();
  }
}

/**
 * The intensity, 0 to 1, up to which a table shows nothing; the table is linear between its
 * entries.
 */
export function floorOf(table: Uint8Array): number {
  for (let i = 0; i < ENTRIES; i++) if (table[4 * i + 3] > 0) return (i - 1) / (ENTRIES - 1);
  return 1;
}

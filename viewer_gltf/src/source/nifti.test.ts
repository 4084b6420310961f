import { gzipSync } from "node:zlib";
import { describe, expect, it } from "vitest";
import { LocalFile } from "./byte_source";
import { canonicalOf } from "./canonical";
import { parseNifti } from "./nifti";
import { openNifti } from "./read_nifti";

type Options = Readonly<{
  version?: 1 | 2;
  isLittle?: boolean;
  dim?: readonly number[];
  datatype?: number;
  pixdim?: readonly number[];
  units?: number;
  slope?: number;
  intercept?: number;
  sform?: readonly number[];
  qform?: Readonly<{ quatern: readonly number[]; offset: readonly number[] }>;
  mark?: string;
}>;

/** A header by the specification of NIfTI-1 or NIfTI-2: 3 x 2 x 2 voxels of int16. */
function header(options: Options = {}): Uint8Array<ArrayBuffer> {
  const { version = 1, isLittle = true, dim = [3, 3, 2, 2, 1, 1, 1, 1], datatype = 4 } = options;
  const { pixdim = [1, 2, 3, 4], units = 2, slope = 0, intercept = 0 } = options;
  const size = version === 1 ? 348 : 540;
  const bytes = new Uint8Array(size + 4);
  const view = new DataView(bytes.buffer);
  const real = (at: number, value: number) =>
    version === 1 ? view.setFloat32(at, value, isLittle) : view.setFloat64(at, value, isLittle);
  const wide = version === 1 ? 4 : 8;
  const reals = (at: number, values: readonly number[]) =>
    values.forEach((value, i) => {
      real(at + i * wide, value);
    });
  view.setInt32(0, size, isLittle);
  dim.forEach((n, i) => {
    if (version === 1) view.setInt16(40 + 2 * i, n, isLittle);
    else view.setBigInt64(16 + 8 * i, BigInt(n), isLittle);
  });
  view.setInt16(version === 1 ? 70 : 12, datatype, isLittle);
  reals(version === 1 ? 76 : 104, pixdim);
  if (version === 1) {
    view.setFloat32(108, 352, isLittle);
    view.setUint8(123, units);
    view.setInt16(252, options.qform ? 1 : 0, isLittle);
    view.setInt16(254, options.sform ? 1 : 0, isLittle);
  } else {
    view.setBigInt64(168, 544n, isLittle);
    view.setInt32(500, units, isLittle);
    view.setInt32(344, options.qform ? 1 : 0, isLittle);
    view.setInt32(348, options.sform ? 1 : 0, isLittle);
  }
  reals(version === 1 ? 112 : 176, [slope, intercept]);
  reals(version === 1 ? 256 : 352, [
    ...(options.qform?.quatern ?? []),
    ...(options.qform?.offset ?? []),
  ]);
  reals(version === 1 ? 280 : 400, options.sform ?? []);
  const mark = options.mark ?? (version === 1 ? "n+1\0" : "n+2\0");
  bytes.set(new TextEncoder().encode(mark), version === 1 ? 344 : 4);
  return bytes;
}

/** A file of 3 x 2 x 2 voxels, 0 to 11 in the order of the file. */
function file(options: Options, pack = (bytes: Uint8Array<ArrayBuffer>) => bytes): File {
  const head = header(options);
  const voxels = new DataView(new ArrayBuffer(24));
  for (let i = 0; i < 12; i++) voxels.setInt16(2 * i, i, options.isLittle ?? true);
  const whole = new Uint8Array(head.length + 24);
  whole.set(head);
  whole.set(new Uint8Array(voxels.buffer), head.length);
  return new File([pack(whole)], "head.nii");
}

const LPS_OF_IDENTITY = {
  axes: [
    [-2, 0, 0],
    [0, -3, 0],
    [0, 0, 4],
  ],
  origin: [-10, -20, 30],
};
const SFORM = [2, 0, 0, 10, 0, 3, 0, 20, 0, 0, 4, 30];

describe("a header of NIfTI", () => {
  it.each([
    [1, true],
    [1, false],
    [2, true],
    [2, false],
  ] as const)("is read, version %i, little-endian: %s", (version, isLittle) => {
    const found = parseNifti(
      header({ version, isLittle, sform: SFORM, slope: 2, intercept: -5 }),
      "x",
    );
    expect(found.isLittleEndian).toBe(isLittle);
    expect(found.shape).toEqual([3, 2, 2]);
    expect([found.type, found.slope, found.intercept]).toEqual(["int16", 2, -5]);
    expect(found.offset).toBe(version === 1 ? 352 : 544);
    expect(found.affine).toEqual(LPS_OF_IDENTITY);
    expect([found.hasSides, found.notes]).toEqual([true, []]);
  });

  it("takes its place from sform, otherwise from qform, otherwise from pixdim alone", () => {
    // a quarter turn about z: quatern_d = sin(45 degrees)
    const qform = { quatern: [0, 0, Math.SQRT1_2], offset: [1, 2, 3] };
    const turned = parseNifti(header({ qform }), "x");
    const expected = [
      [0, -2, 0], // the first axis runs to anterior, which is -P
      [3, 0, 0], // the second to the right's opposite: left
      [0, 0, 4],
    ];
    turned.affine.axes.forEach((axis, i) => {
      for (const part of [0, 1, 2]) expect(axis[part]).toBeCloseTo(expected[i][part], 5);
    });
    expect(turned.affine.origin).toEqual([-1, -2, 3]);
    expect(parseNifti(header({ qform, sform: SFORM }), "x").affine).toEqual(LPS_OF_IDENTITY);
    const plain = parseNifti(header(), "x");
    expect(plain.hasSides).toBe(false);
    expect(plain.notes).toEqual([
      "The file states no orientation, so left and right may be swapped.",
    ]);
    expect(plain.affine.axes.map((axis) => Math.hypot(...axis))).toEqual([2, 3, 4]);
  });

  it("mirrors the third axis where qfac is negative", () => {
    const qform = { quatern: [0, 0, 0], offset: [0, 0, 0] };
    const { affine } = parseNifti(header({ qform, pixdim: [-1, 2, 3, 4] }), "x");
    expect(affine.axes[2]).toEqual([0, 0, -4].map((v) => v + 0));
  });

  it("ignores an orientation without three independent axes", () => {
    const flat = parseNifti(
      header({ sform: new Array(12).fill(0), qform: { quatern: [0, 0, 0], offset: [0, 0, 0] } }),
      "x",
    );
    expect(flat.notes).toEqual([
      "The sform of the file is not used, because its three axes are not independent.",
    ]);
    expect(flat.hasSides).toBe(true);
  });

  it.each([
    [1, 1000],
    [2, 1],
    [3, 0.001],
    [0, 1],
  ])("has lengths in its unit: code %i is %f mm", (units, mm) => {
    const { affine } = parseNifti(header({ units, sform: SFORM }), "x");
    expect(affine.axes[0][0]).toBeCloseTo(-2 * mm, 9);
  });

  it("leaves values unscaled if the slope is 0 or not a number", () => {
    for (const slope of [0, Number.NaN]) {
      const found = parseNifti(header({ slope, intercept: 100 }), "x");
      expect([found.slope, found.intercept]).toEqual([1, 0]);
    }
  });

  it.each([
    [{ mark: "ni1\0" }, "expected a single file: save it as .nii"],
    [{ mark: "abc\0" }, "found no NIfTI header"],
    [{ datatype: 128 }, "datatype is colours"],
    [{ datatype: 32 }, "datatype is complex numbers"],
    [{ datatype: 77 }, "datatype is code 77"],
    [{ dim: [2, 3, 2, 1, 1, 1, 1, 1] }, "dim is 3 x 2, expected x, y, z"],
    [{ dim: [5, 3, 2, 2, 1, 3, 1, 1] }, "dim is 3 x 2 x 2 x 1 x 3"],
    [{ dim: [3, 3, -2, 2, 1, 1, 1, 1] }, "dim is 3 x -2 x 2"],
    [{ dim: [9999, 3, 2, 2, 0, 1, 1, 1] }, "dim is"],
  ] as const)("is refused: %j", (options, text) => {
    expect(() => parseNifti(header(options), "head.nii")).toThrow(text);
  });

  it("is refused if it is cut short, or is not from a NIfTI file", () => {
    for (const bytes of [new Uint8Array(0), header().slice(0, 200), new Uint8Array(600)]) {
      expect(() => parseNifti(bytes, "head.nii")).toThrow("head.nii: found no NIfTI header");
    }
  });
});

describe("a file of NIfTI", () => {
  const read = async (given: File) => {
    const image = await openNifti(new LocalFile(given), () => undefined);
    const [channel] = image.channels;
    return { image, coarse: await channel.read() };
  };

  it.each([true, false])("gives its values, little-endian: %s", async (isLittle) => {
    const { image, coarse } = await read(
      file({ isLittle, sform: SFORM, slope: 0.5, intercept: 1 }),
    );
    // canonical: z to the front (anterior, +y of RAS), y down (inferior), x to the left (-x of RAS)
    expect(image.shape).toEqual([2, 2, 3]);
    expect(image.spacing_um).toEqual([3000, 4000, 2000]);
    const stored = [8, 7, 6, 2, 1, 0, 11, 10, 9, 5, 4, 3]; // by hand
    expect([...coarse.voxels]).toEqual(stored.map((v) => 0.5 * v + 1));
  });

  it("may be gzipped", async () => {
    const packed = file({ sform: SFORM }, (bytes) => new Uint8Array(gzipSync(bytes)));
    expect((await read(packed)).coarse.voxels.length).toBe(12);
  });

  it("shows the first time point, and notes that", async () => {
    const { image } = await read(file({ sform: SFORM, dim: [4, 3, 2, 1, 2, 1, 1, 1] }));
    expect(image.notes).toEqual(["Only the first of 2 time points is shown."]);
  });

  it("is refused if it is cut short or damaged", async () => {
    const whole = file({ sform: SFORM });
    await expect(read(new File([whole.slice(0, 370)], "head.nii"))).rejects.toThrow(
      "head.nii: found 18 bytes of voxels, expected 24: the file is incomplete.",
    );
    const packed = gzipSync(new Uint8Array(await whole.arrayBuffer()));
    packed.fill(7, 12, 40);
    await expect(read(new File([packed], "head.nii.gz"))).rejects.toThrow("can't be unpacked");
    const large = file({ dim: [3, 30000, 30000, 3000, 1, 1, 1, 1] });
    await expect(read(large)).rejects.toThrow("too large for a page");
  });
});

describe("canonical axes", () => {
  it("leave a grid that runs to anterior, inferior and left unchanged", () => {
    const { order, flips, placement } = canonicalOf(
      {
        axes: [
          [0, -1, 0],
          [0, 0, -1],
          [1, 0, 0],
        ],
        origin: [5, 6, 7],
      },
      [4, 3, 2],
    );
    expect([order, flips]).toEqual([
      [0, 1, 2],
      [false, false, false],
    ]);
    expect(placement).toEqual([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5000, 7000, -6000, 1]);
  });
});

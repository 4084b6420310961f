/**
 * Reads the header of NIfTI-1 and NIfTI-2: type, shape and place of the voxels. Pure.
 *
 * The place is that of sform, otherwise of qform, otherwise of pixdim alone, as in most programs and in
 * pipeline/stereocell/read/formats/nifti/statements.py. Texts in the header may identify a patient and are not read.
 *
 * References: NIfTI-1 Data Format, https://nifti.nimh.nih.gov/nifti-1/
 */
import type { Affine } from "./canonical";
import { lengthOf } from "./canonical";
import { type Triple, triple } from "./coarse_volume";
import { SourceError } from "./source_error";

/** Bytes of the longest header. */
export const HEADER_BYTES = 540;

/** A number type of the voxels. */
export type VoxelType =
  | "uint8"
  | "int8"
  | "int16"
  | "uint16"
  | "int32"
  | "uint32"
  | "float32"
  | "float64";

const TYPES: Readonly<Record<number, VoxelType>> = {
  ...{ 2: "uint8", 4: "int16", 8: "int32", 16: "float32", 64: "float64" },
  ...{ 256: "int8", 512: "uint16", 768: "uint32" },
};
const BYTES: Readonly<Record<VoxelType, number>> = {
  ...{ uint8: 1, int8: 1, int16: 2, uint16: 2, int32: 4, uint32: 4, float32: 4, float64: 8 },
};
/** Types that are not supported, by their code. */
const OTHERS: Readonly<Record<number, string>> = {
  ...{ 1: "bits", 32: "complex numbers", 128: "colours", 1024: "whole numbers of 64 bits" },
  ...{ 1280: "whole numbers of 64 bits", 1536: "numbers of 128 bits" },
  ...{ 1792: "complex numbers", 2048: "complex numbers", 2304: "colours" },
};

export type NiftiHeader = Readonly<{
  type: VoxelType;
  bytesPerVoxel: number;
  isLittleEndian: boolean;
  /** Number of voxels along x, y and z; x is stored fastest. */
  shape: Triple;
  times: number;
  /** Number of bytes of the unpacked file before the first voxel. */
  offset: number;
  slope: number;
  intercept: number;
  /** Stored axes x, y, z in LPS, mm. */
  affine: Affine;
  /** Whether the header states which side of the patient is which. */
  hasSides: boolean;
  notes: readonly string[];
}>;

/** Offsets of the fields of a header; NIfTI-2 has wider numbers in another order. */
const FIELDS = {
  1: {
    ...{ dim: 40, datatype: 70, pixdim: 76, offset: 108, slope: 112, intercept: 116, units: 123 },
    ...{ qformCode: 252, sformCode: 254, quatern: 256, qoffset: 268, srow: 280 },
  },
  2: {
    ...{ dim: 16, datatype: 12, pixdim: 104, offset: 168, slope: 176, intercept: 184, units: 500 },
    ...{ qformCode: 344, sformCode: 348, quatern: 352, qoffset: 376, srow: 400 },
  },
} as const;

/** Smallest volume of the parallelepiped of three unit axes; with less, the axes nearly lie in a plane. */
const MIN_VOLUME = 0.1;
/** Largest cosine between two axes that is due to rounding. */
const SKEW = 1e-3;
const MM: Readonly<Record<number, number>> = { 1: 1000, 2: 1, 3: 0.001 };

/**
 * @param bytes at least the first HEADER_BYTES of the unpacked file, or all of a shorter one
 * Throws SourceError.
 */
export function parseNifti(bytes: Uint8Array, where: string): NiftiHeader {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const isLittleEndian = bytes.length >= 4 && [348, 540].includes(view.getInt32(0, true));
  const size = bytes.length >= 4 ? view.getInt32(0, isLittleEndian) : 0;
  const mark = String.fromCharCode(...bytes.subarray(...(size === 540 ? [4, 7] : [344, 347])));
  const isWhole = bytes.length >= size && (size === 348 || size === 540);
  if (!isWhole || !/^n[+i][12]$/.test(mark)) {
    throw new SourceError(`${where}: found no NIfTI header, expected a complete .nii or .nii.gz.`);
  }
  if (mark[1] === "i") {
    throw new SourceError(
      `${where}: found the header of a .hdr and .img pair, expected a single file: save it as .nii.`,
    );
  }
  const version = size === 540 ? 2 : 1;
  const at = FIELDS[version];
  const real = (place: number) =>
    version === 1 ? view.getFloat32(place, isLittleEndian) : view.getFloat64(place, isLittleEndian);
  const whole = (place: number) =>
    version === 1
      ? view.getInt16(place, isLittleEndian)
      : Number(view.getBigInt64(place, isLittleEndian));
  const wide = version === 1 ? 4 : 8;
  const reals = (place: number, count: number) =>
    Array.from({ length: count }, (_, i) => real(place + i * wide));

  const dim = Array.from({ length: 8 }, (_, i) => whole(at.dim + (i * wide) / (3 - version)));
  const shape = dim.slice(1, 1 + Math.min(7, Math.max(0, dim[0])));
  if (shape.length < 3 || shape.some((n) => n < 1) || shape.slice(4).some((n) => n !== 1)) {
    throw new SourceError(
      `${where}: dim is ${shape.join(" x ")}, expected x, y, z, or x, y, z, t.`,
    );
  }
  const code = view.getInt16(at.datatype, isLittleEndian);
  const type = TYPES[code];
  if (type === undefined) {
    const found = OTHERS[code] ?? `code ${code}`;
    throw new SourceError(
      `${where}: datatype is ${found}, expected integers of up to 32 bits or floating-point numbers.`,
    );
  }
  const offset = version === 1 ? real(at.offset) : whole(at.offset);
  const units = version === 1 ? view.getUint8(at.units) : view.getInt32(at.units, isLittleEndian);
  const unit = MM[units & 7] ?? 1;
  const pixdim = reals(at.pixdim, 4);
  const [, dx, dy, dz] = pixdim.map((value) => Math.abs(value) || 1);
  const codeOf = (place: number) =>
    version === 1 ? view.getInt16(place, isLittleEndian) : view.getInt32(place, isLittleEndian);
  const forms: [string, Affine][] = [];
  if (codeOf(at.sformCode) > 0) forms.push(["sform", sformOf(reals(at.srow, 12))]);
  if (codeOf(at.qformCode) > 0) {
    const sign = pixdim[0] < 0 ? -1 : 1;
    const quatern = reals(at.quatern, 3);
    forms.push(["qform", qformOf(quatern, reals(at.qoffset, 3), [dx, dy, sign * dz])]);
  }
  const sound = forms.filter(([, form]) => isSound(form));
  const notes = forms
    .filter(([, form]) => !isSound(form))
    .map(
      ([name]) =>
        `The ${name} of the file is not used, because its three axes are not independent.`,
    );
  const plain: Affine = {
    axes: [
      [dx, 0, 0],
      [0, dy, 0],
      [0, 0, dz],
    ],
    origin: [0, 0, 0],
  };
  const ras = sound.length > 0 ? sound[0][1] : plain;
  if (!isSound(ras)) {
    throw new SourceError(`${where}: pixdim has no valid lengths, expected three voxel spacings.`);
  }
  if (sound.length === 0) {
    notes.push("The file states no orientation, so left and right may be swapped.");
  }
  if (skewOf(ras) > SKEW) {
    notes.push(
      "The axes of the file are not at right angles, but the volume is shown as if they were.",
    );
  }
  if ((shape[3] ?? 1) > 1) {
    notes.push(`Only the first of ${shape[3]} time points is shown.`);
  }
  const [slope, intercept] = [real(at.slope), real(at.intercept)];
  const isScaled = Number.isFinite(slope) && slope !== 0;
  return {
    ...{ type, bytesPerVoxel: BYTES[type], isLittleEndian, notes },
    shape: [shape[0], shape[1], shape[2]],
    times: shape[3] ?? 1,
    offset: Math.max(Math.round(offset) || 0, size + 4),
    slope: isScaled ? slope : 1,
    intercept: isScaled && Number.isFinite(intercept) ? intercept : 0,
    affine: toLps(ras, unit),
    hasSides: sound.length > 0,
  };
}

/** Turns the three rows of an RAS matrix into the columns of an affine. */
function sformOf(rows: readonly number[]): Affine {
  const column = (i: number): Triple => [rows[i], rows[4 + i], rows[8 + i]];
  return { axes: [column(0), column(1), column(2)], origin: column(3) };
}

/** @param scale lengths of the axes; that of z is negative where the grid is left-handed */
function qformOf(
  [b, c, d]: readonly number[],
  offset: readonly number[],
  [sx, sy, sz]: Triple,
): Affine {
  const rest = 1 - (b * b + c * c + d * d);
  // Rounding may make the difference slightly negative.
  const a = rest > -1e-5 ? Math.sqrt(Math.max(0, rest)) : Number.NaN;
  return {
    axes: [
      [sx * (a * a + b * b - c * c - d * d), sx * 2 * (b * c + a * d), sx * 2 * (b * d - a * c)],
      [sy * 2 * (b * c - a * d), sy * (a * a + c * c - b * b - d * d), sy * 2 * (c * d + a * b)],
      [sz * 2 * (b * d + a * c), sz * 2 * (c * d - a * b), sz * (a * a + d * d - b * b - c * c)],
    ],
    origin: [offset[0], offset[1], offset[2]],
  };
}

function toLps({ axes, origin }: Affine, unit: number): Affine {
  // adding 0 turns -0 into 0
  const turn = ([r, a, s]: Triple): Triple => [-r * unit + 0, -a * unit + 0, s * unit + 0];
  return { axes: [turn(axes[0]), turn(axes[1]), turn(axes[2])], origin: turn(origin) };
}

function isSound({ axes, origin }: Affine): boolean {
  if (![...axes.flat(), ...origin].every(Number.isFinite)) return false;
  if (axes.some((axis) => lengthOf(axis) === 0)) return false;
  const [a, b, c] = unitsOf(axes);
  const volume =
    a[0] * (b[1] * c[2] - b[2] * c[1]) +
    a[1] * (b[2] * c[0] - b[0] * c[2]) +
    a[2] * (b[0] * c[1] - b[1] * c[0]);
  return Math.abs(volume) >= MIN_VOLUME;
}

const unitsOf = (axes: Affine["axes"]) =>
  axes.map((axis) => triple((i) => axis[i] / lengthOf(axis)));

/** Largest cosine between two axes. */
function skewOf({ axes }: Affine): number {
  const [a, b, c] = unitsOf(axes);
  const cosine = (p: Triple, q: Triple) => Math.abs(p[0] * q[0] + p[1] * q[1] + p[2] * q[2]);
  return Math.max(cosine(a, b), cosine(b, c), cosine(c, a));
}

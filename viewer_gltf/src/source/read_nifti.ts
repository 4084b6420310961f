/** Opens a NIfTI file, `.nii` or `.nii.gz`. Reading stops after the first time point. */
import type { ByteSource } from "./byte_source";
import { canonicalOf, turned } from "./canonical";
import { blockFor, makeCoarse, SHOWN_VOXELS, triple, volumeOf } from "./coarse_volume";
import { HEADER_BYTES, type NiftiHeader, parseNifti, type VoxelType } from "./nifti";
import type { OpenedImage, Report } from "./opened_image";
import { SourceError } from "./source_error";
import { partsOf } from "./zip_store";

/** Largest volume that is read, bytes. Reading needs twice that, and a page has little more memory. */
const MAX_BYTES = 1 << 30;
/** Largest size of the header and its extensions before the voxels, bytes. */
const MAX_OFFSET = 1 << 28;

const ARRAYS: Readonly<
  Record<VoxelType, new (buffer: ArrayBuffer, offset: number, length: number) => ArrayLike<number>>
> = {
  ...{ uint8: Uint8Array, int8: Int8Array, int16: Int16Array, uint16: Uint16Array },
  ...{ int32: Int32Array, uint32: Uint32Array, float32: Float32Array, float64: Float64Array },
};
const IS_LITTLE_ENDIAN = new Uint8Array(Uint16Array.of(1).buffer)[0] === 1;

export async function openNifti(file: ByteSource, report: Report): Promise<OpenedImage> {
  const { name } = file;
  const { header, voxels } = await readFile(file, report);
  const [nx, ny, nz] = header.shape;
  const canonical = canonicalOf(header.affine, header.shape);
  const { slope, intercept } = header;
  const stored = turned(
    {
      ...{ data: arrayOf(voxels, header), slope, intercept },
      ...{ shape: header.shape, strides: [1, nx, nx * ny], offset: 0 },
    },
    canonical,
  );
  const { shape } = stored;
  const block = blockFor(shape, canonical.spacing_um, SHOWN_VOXELS);
  const notes = [...header.notes];
  if (volumeOf(block) > 1) {
    const size = triple((i) => Math.floor(shape[i] / block[i]));
    notes.push(
      `The volume is reduced from ${nx} x ${ny} x ${nz} to ${size[2]} x ${size[1]} x ${size[0]} voxels. Use ` +
        "stereocell build to see all voxels.",
    );
  }
  return {
    // the file's name is not shown: it may identify a patient, and images and links of the page are shared
    ...{ name: "NIfTI", shape, notes },
    spacing_um: canonical.spacing_um,
    placement: canonical.placement,
    hasSides: header.hasSides,
    isSigned: !header.type.startsWith("u") || header.intercept < 0,
    channels: [
      {
        ...{ name: "NIfTI", color: null, window: null, opens: true },
        read: async () => makeCoarse(stored, block, { first: [0, 0, 0], step: [1, 1, 1] }, name),
      },
    ],
  };
}

/** The header, and the bytes of the voxels at the first time point. */
type FirstVolume = Readonly<{ header: NiftiHeader; voxels: Uint8Array<ArrayBuffer> }>;

/** Throws SourceError. */
async function readFile(file: ByteSource, report: Report): Promise<FirstVolume> {
  const { name } = file;
  let head = new Uint8Array(0);
  let volume: FirstVolume | null = null;
  let seen = 0; // bytes of the unpacked file
  for await (const part of unpackedParts(file)) {
    if (volume === null) {
      head = joined(head, part);
      if (head.length >= HEADER_BYTES) volume = begin(head, name);
    } else copyInto(volume.voxels, part, seen - volume.header.offset);
    seen += part.length;
    if (volume === null) continue;
    const share = Math.max(0, seen - volume.header.offset) / volume.voxels.length;
    if (share >= 1) break;
    report(`Reading ${name}: ${Math.round(100 * share)} %`);
  }
  volume ??= begin(head, name); // a file shorter than the longest header
  const found = Math.max(0, seen - volume.header.offset);
  const expected = volume.voxels.length;
  if (found < expected) {
    throw new SourceError(
      `${name}: found ${found} bytes of voxels, expected ${expected}: the file is incomplete.`,
    );
  }
  return volume;
}

/** Reads the header at the start of a file, allocates the voxels, and copies the first of them. */
function begin(head: Uint8Array, name: string): FirstVolume {
  const header = parseNifti(head, name);
  const voxels = new Uint8Array(bytesOf(header, name));
  copyInto(voxels, head, -header.offset);
  return { header, voxels };
}

function joined(a: Uint8Array<ArrayBuffer>, b: Uint8Array<ArrayBuffer>): Uint8Array<ArrayBuffer> {
  const both = new Uint8Array(a.length + b.length);
  both.set(a);
  both.set(b, a.length);
  return both;
}

/** Copies bytes to an offset of the target. Bytes before its start or after its end are dropped. */
function copyInto(target: Uint8Array, bytes: Uint8Array, at: number): void {
  const from = Math.max(0, -at);
  const to = Math.min(bytes.length, target.length - at);
  if (to > from) target.set(bytes.subarray(from, to), at + from);
}

/** Returns the size of the first volume in bytes. Throws SourceError if it is too large for a page. */
function bytesOf({ shape, bytesPerVoxel, offset }: NiftiHeader, name: string): number {
  const bytes = volumeOf(shape) * bytesPerVoxel;
  if (bytes <= MAX_BYTES && offset <= MAX_OFFSET) return bytes;
  throw new SourceError(
    `${name}: found a volume of ${Math.round(bytes / 1e6)} MB, which is too large for a page: open it with stereocell view.`,
  );
}

/** Yields the file's bytes as they arrive, unpacked if the file is gzipped. Throws SourceError. */
async function* unpackedParts(file: ByteSource): AsyncGenerator<Uint8Array<ArrayBuffer>> {
  const [forMark, whole] = (await file.stream()).tee();
  const reader = forMark.getReader();
  try {
    const { value } = await reader.read();
    void reader.cancel();
    const isPacked = value?.[0] === 0x1f && value[1] === 0x8b;
    yield* partsOf(isPacked ? whole.pipeThrough(new DecompressionStream("gzip")) : whole);
  } catch (error) {
    throw new SourceError(
      `${file.name}: the file can't be unpacked, or the connection broke, expected a complete .nii or .nii.gz: try again, or make the file again.`,
      { cause: error },
    );
  }
}

function arrayOf(
  voxels: Uint8Array<ArrayBuffer>,
  { type, bytesPerVoxel, isLittleEndian }: NiftiHeader,
): ArrayLike<number> {
  if (isLittleEndian !== IS_LITTLE_ENDIAN && bytesPerVoxel > 1) {
    for (let at = 0; at < voxels.length; at += bytesPerVoxel) {
      voxels.subarray(at, at + bytesPerVoxel).reverse();
    }
  }
  return new ARRAYS[type](voxels.buffer, 0, voxels.length / bytesPerVoxel);
}

/** Opens a source in the page, without a server. This is the entry of the folder; it loads when a source is opened. */
import type { Bundle } from "../bundle/load";
import { type ByteSource, LocalFile, LocalFolder } from "./byte_source";
import { makeBundle } from "./make_bundle";
import type { OpenedImage, Report } from "./opened_image";
import { openNifti } from "./read_nifti";
import { openZarr } from "./read_zarr";
import { RemoteFile, RemoteFolder } from "./remote_file";
import { SourceError } from "./source_error";
import { isNothingFound } from "./zarr_faults";
import { ZipStore } from "./zip_store";

/** A source as a bundle, and sentences that the viewer shows as notices. */
export type ShownSource = Readonly<{ bundle: Bundle; notes: readonly string[] }>;

const NIFTI = /\.nii(\.gz)?$/i;
const ARCHIVE = /\.(ozx|zip)$/i;
/** An address whose end looks like that of a file's name. */
const FILE = /\.[a-z][a-z0-9]{1,4}$/i;
const ENDINGS = /(\.ome)?\.(zarr(\.zip)?|ozx|zip)$|\.nii(\.gz)?$/i;

/** Opens the image at an address of the web. Throws SourceError. */
export async function openAddress(address: string, report: Report): Promise<ShownSource> {
  const url = new URL(address);
  const path = url.pathname.replace(/\/+$/, "");
  report(`Asking ${url.host}`);
  if (NIFTI.test(path) || ARCHIVE.test(path))
    return shown(await openFile(new RemoteFile(url), report), report);
  const name = nameOf(path) || url.host;
  try {
    return await shown(await openZarr(new RemoteFolder(url), name), report);
  } catch (error) {
    if (!isNothingFound(error)) throw error;
    if (FILE.test(path) && !path.endsWith(".zarr")) throw otherFormat(name, url.href);
    // Shows the whole address: one without https:// was resolved relative to the page, which its user did not intend.
    const { message } = error as SourceError;
    throw new SourceError(message.replace(`${name}:`, `${url.href}:`));
  }
}

/** A file or a folder of this machine that the user has dropped or chosen. */
export type LocalSource =
  | Readonly<{ kind: "file"; file: File }>
  | Readonly<{ kind: "folder"; name: string; find: (path: string) => Promise<File | null> }>;

/** Opens a file or a folder of this machine. Its data never leave the machine. Throws SourceError. */
export async function openLocal(source: LocalSource, report: Report): Promise<ShownSource> {
  if (source.kind === "file")
    return shown(await openFile(new LocalFile(source.file), report), report);
  const name = nameOf(source.name);
  try {
    return await shown(await openZarr(new LocalFolder(source.find), name), report);
  } catch (error) {
    throw isNothingFound(error) ? otherFormat(name) : error;
  }
}

async function openFile(file: ByteSource, report: Report): Promise<OpenedImage> {
  const { name } = file;
  if (NIFTI.test(name)) return openNifti(file, report);
  if (ARCHIVE.test(name)) return openZarr(await ZipStore.open(file), nameOf(name));
  throw otherFormat(name);
}

function otherFormat(name: string, address = ""): SourceError {
  return new SourceError(
    `${name}: found another format, expected NIfTI (.nii, .nii.gz) or OME-Zarr (a folder or .ozx): open it with ` +
      `stereocell view ${address}`.trimEnd(),
  );
}

async function shown(image: OpenedImage, report: Report): Promise<ShownSource> {
  return { bundle: await makeBundle(image, report), notes: image.notes };
}

/** The last part of a path, without the endings of formats. */
function nameOf(path: string): string {
  const last = path.split("/").filter(Boolean).pop() ?? "";
  let name = last;
  try {
    name = decodeURIComponent(last);
  } catch {
    // a folder's name may hold a % of its own
  }
  return name.replace(ENDINGS, "") || name;
}

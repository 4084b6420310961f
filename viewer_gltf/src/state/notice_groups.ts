/** Groups notices for display: notices of many files with the same fault are shown as one. Pure. */

export type NoticeGroup = Readonly<{
  /** The text that the page shows for the group. */
  text: string;
  /** Notices in the group, which are dismissed together. */
  of: readonly string[];
}>;

/** Matches `volumes/r0_c0/CD8.ktx2: the host answered with status 404`; the fault may have several lines. */
const FILE_NOTICE = /^(\S+\.\w{2,11}): (.+)$/s;
/** Parts of a notice that differ from file to file: sizes, hashes, numbers of mip levels. */
const VARYING_PARTS = /\b[0-9a-f]{8,}\b|\d+/g;

function faultOf(notice: string): string | null {
  const [, file, fault] = FILE_NOTICE.exec(notice) ?? [];
  if (file === undefined) return null;
  const ending = file.slice(file.lastIndexOf("."));
  return `${ending} ${fault.replaceAll(file, "").replace(VARYING_PARTS, "#")}`;
}

/** Returns the groups in the order of their newest notices. */
export function groupNotices(notices: readonly string[]): readonly NoticeGroup[] {
  const groups = new Map<string, string[]>();
  for (const notice of notices) {
    const key = faultOf(notice) ?? `alone ${notice}`;
    const before = groups.get(key) ?? [];
    groups.delete(key); // a group with a new notice goes last
    groups.set(key, [...before, notice]);
  }
  return [...groups.values()].map((of) => {
    const more = of.length - 1;
    const others = more === 0 ? "" : ` And ${more} more ${more === 1 ? "file" : "files"} like it.`;
    return { text: `${of[0]}${others}`, of };
  });
}

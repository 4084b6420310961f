/** Notices as they are shown: those of many files with the same fault are one. Pure. */

export type NoticeGroup = Readonly<{
  /** What is read. */
  text: string;
  /** The notices that it stands for, which are dismissed with it. */
  of: readonly string[];
}>;

/** `volumes/r0_c0/CD8.ktx2: the host answers 404`, or several lines of it. */
const OF_A_FILE = /^(\S+\.\w{2,11}): (.+)$/s;
/** Parts of a notice that differ from file to file: sizes, hashes, levels, the file's own name. */
const PARTICULARS = /\b[0-9a-f]{8,}\b|\d+/g;

function faultOf(notice: string): string | null {
  const [, file, fault] = OF_A_FILE.exec(notice) ?? [];
  if (file === undefined) return null;
  const ending = file.slice(file.lastIndexOf("."));
  return `${ending} ${fault.replaceAll(file, "").replace(PARTICULARS, "#")}`;
}

/** In the order of each group's newest. */
export function groupNotices(notices: readonly string[]): readonly NoticeGroup[] {
  const groups = new Map<string, string[]>();
  for (const notice of notices) {
    const key = faultOf(notice) ?? `alone ${notice}`;
    const before = groups.get(key) ?? [];
    groups.delete(key); // it goes last
    groups.set(key, [...before, notice]);
  }
  return [...groups.values()].map((of) => {
    const more = of.length - 1;
    const others = more === 0 ? "" : ` And ${more} more ${more === 1 ? "file" : "files"} like it.`;
    return { text: `${of[0]}${others}`, of };
  });
}

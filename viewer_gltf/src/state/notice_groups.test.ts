import { describe, expect, it } from "vitest";
import { groupNotices } from "./notice_groups";

const missing = (n: number) => `volumes/r0_c${n}/CD8.ktx2: the host answered with status 404`;

describe("notices", () => {
  it("form one group if many files have the same fault", () => {
    const all = [missing(0), missing(1), missing(2)];
    expect(groupNotices(all)).toEqual([
      { text: `${missing(0)} And 2 more files like it.`, of: all },
    ]);
  });

  it("belong together although their sizes and hashes differ", () => {
    const short = (n: number) =>
      `a/${n}.glb: expected ${n + 100} bytes with the hash ${"abcdef01".repeat(n)}, found ${n}`;
    const [group] = groupNotices([short(1), short(2)]);
    expect(group.text).toBe(`${short(1)} And 1 more file like it.`);
  });

  it("stand alone if the fault or the kind of file differs, newest last", () => {
    const texts = [
      missing(0),
      "a.glb: the host answered with status 404",
      "a.glb: it is cut short",
      "Link: box: expected 6 numbers",
      "Link: box: expected 7 numbers",
    ];
    expect(groupNotices(texts).map(({ of }) => of)).toEqual(texts.map((text) => [text]));
    const again = groupNotices([...texts, missing(1)]);
    expect(again.at(-1)?.of).toEqual([missing(0), missing(1)]);
  });
});

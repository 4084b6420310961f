import { deflateRawSync } from "node:zlib";
import { describe, expect, it } from "vitest";
import { LocalFile } from "./byte_source";
import { ZipStore } from "./zip_store";

type Member = Readonly<{
  name: string;
  text: string;
  method?: number;
  flags?: number;
  unpacked?: number;
}>;

/** Writes an archive by PKWARE's APPNOTE; `isWide` adds the records for 64-bit numbers. */
function archive(members: readonly Member[], isWide = false, comment = ""): File {
  const parts: Uint8Array[] = [];
  const list: Uint8Array[] = [];
  const sizeOf = (all: readonly Uint8Array[]) => all.reduce((sum, part) => sum + part.length, 0);
  for (const { name, text, method = 0, flags = 0, unpacked } of members) {
    const title = new TextEncoder().encode(name);
    const plain = new TextEncoder().encode(text);
    const content = method === 8 ? new Uint8Array(deflateRawSync(plain)) : plain;
    const at = sizeOf(parts);
    const local = new DataView(new ArrayBuffer(30));
    local.setUint32(0, 0x04034b50, true);
    local.setUint16(26, title.length, true);
    local.setUint16(28, 9, true); // longer than in the list of members
    parts.push(new Uint8Array(local.buffer), title, new Uint8Array(9), content);
    const entry = new DataView(new ArrayBuffer(46));
    entry.setUint32(0, 0x02014b50, true);
    entry.setUint16(8, flags, true);
    entry.setUint16(10, method, true);
    const size = unpacked ?? plain.length;
    entry.setUint32(20, isWide ? 0xffffffff : content.length, true);
    entry.setUint32(24, isWide ? 0xffffffff : size, true);
    entry.setUint16(28, title.length, true);
    entry.setUint16(30, isWide ? 28 : 0, true);
    entry.setUint32(42, isWide ? 0xffffffff : at, true);
    list.push(new Uint8Array(entry.buffer), title);
    if (!isWide) continue;
    const extra = new DataView(new ArrayBuffer(28));
    extra.setUint16(0, 1, true);
    extra.setUint16(2, 24, true);
    [size, content.length, at].forEach((n, i) => {
      extra.setBigUint64(4 + 8 * i, BigInt(n), true);
    });
    list.push(new Uint8Array(extra.buffer));
  }
  const [offset, bytes] = [sizeOf(parts), sizeOf(list)];
  parts.push(...list);
  if (isWide) {
    const record = new DataView(new ArrayBuffer(56));
    record.setUint32(0, 0x06064b50, true);
    [members.length, bytes, offset].forEach((n, i) => {
      record.setBigUint64(32 + 8 * i, BigInt(n), true);
    });
    const locator = new DataView(new ArrayBuffer(20));
    locator.setUint32(0, 0x07064b50, true);
    locator.setBigUint64(8, BigInt(offset + bytes), true);
    parts.push(new Uint8Array(record.buffer), new Uint8Array(locator.buffer));
  }
  const end = new DataView(new ArrayBuffer(22));
  end.setUint32(0, 0x06054b50, true);
  end.setUint16(10, isWide ? 0xffff : members.length, true);
  end.setUint32(12, isWide ? 0xffffffff : bytes, true);
  end.setUint32(16, isWide ? 0xffffffff : offset, true);
  end.setUint16(20, comment.length, true);
  parts.push(new Uint8Array(end.buffer), new TextEncoder().encode(comment));
  return new File(parts as BlobPart[], "image.ozx");
}

const GROUP: Member = { name: "zarr.json", text: "{}" };
const open = (file: File) => ZipStore.open(new LocalFile(file));
const textOf = (bytes: Uint8Array | undefined) => bytes && new TextDecoder().decode(bytes);

describe("a zip archive of OME-Zarr", () => {
  it.each([false, true])(
    "gives its members, whole and in part; records of 64 bits: %s",
    async (isWide) => {
      const members = [
        GROUP,
        { name: "0/c/0", text: "abcdefgh" },
        { name: "0/c/1", text: "packed packed", method: 8 },
      ];
      const store = await open(archive(members, isWide, "PK\u0005 a comment"));
      expect(textOf(await store.get("/0/c/0"))).toBe("abcdefgh");
      expect(textOf(await store.get("/0/c/1"))).toBe("packed packed");
      expect(await store.get("/0/c/2")).toBeUndefined();
      expect(textOf(await store.getRange("/0/c/0", { offset: 2, length: 3 }))).toBe("cde");
      expect(textOf(await store.getRange("/0/c/0", { suffixLength: 2 }))).toBe("gh");
      expect(textOf(await store.getRange("/0/c/1", { offset: 7, length: 6 }))).toBe("packed");
      expect(await store.getRange("/0/c/2", { suffixLength: 2 })).toBeUndefined();
    },
  );

  it("may contain the group in its only folder", async () => {
    const store = await open(
      archive([
        { name: "a.zarr/.zgroup", text: "1" },
        { name: "a.zarr/0/0", text: "2" },
      ]),
    );
    expect(textOf(await store.get("/0/0"))).toBe("2");
  });

  it.each([
    ["no archive", new File(["no zip at all"], "image.ozx"), "found no complete zip archive"],
    ["an empty file", new File([], "image.ozx"), "found no complete zip archive"],
    ["no group", archive([{ name: "a.txt", text: "1" }]), "without a Zarr group"],
    [
      "two groups",
      archive([
        { name: "a/zarr.json", text: "" },
        { name: "b/zarr.json", text: "" },
      ]),
      "without a Zarr group",
    ],
    ["a password", archive([{ ...GROUP, flags: 1 }]), "has a password"],
  ])("is refused: %s", async (_, file, text) => {
    await expect(open(file)).rejects.toThrow(text);
  });

  it("is refused if its list of members is damaged", async () => {
    const bytes = new Uint8Array(await archive([GROUP, { name: "0/0", text: "x" }]).arrayBuffer());
    const at = bytes.length - 22 - 46 - 3;
    for (const [place, value] of [
      [at, 0], // no entry
      [at + 20, 250], // longer than the file
      [at + 28, 255], // a name beyond the list
    ]) {
      const damaged = bytes.slice();
      damaged[place] = value;
      await expect(open(new File([damaged], "image.ozx"))).rejects.toThrow("damaged");
    }
  });

  it("is refused if a member has another size than listed, or an unknown compression method", async () => {
    for (const unpacked of [3, 300]) {
      const store = await open(
        archive([GROUP, { name: "0", text: "packed", method: 8, unpacked }]),
      );
      await expect(store.get("/0")).rejects.toThrow("0 is damaged");
    }
    const store = await open(archive([GROUP, { name: "0", text: "x", method: 93 }]));
    await expect(store.get("/0")).rejects.toThrow("packed by method 93");
  });
});

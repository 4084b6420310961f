import { read } from "ktx-parse";
import { describe, expect, it } from "vitest";
import { ZSTDDecoder } from "zstddec";
import { storeZstd, writeKtx2 } from "./texture_file";

describe("a texture", () => {
  it.each([1, 2, 4] as const)("is readable by ktx-parse with %i components", async (channels) => {
    const zstd = new ZSTDDecoder();
    await zstd.init();
    const sizes =
      channels === 4
        ? [[5, 3, 1]]
        : [
            [5, 3, 2],
            [2, 1, 1],
          ];
    const levels = sizes.map(([x, y, z]) =>
      Uint8Array.from({ length: x * y * z * channels }, (_, i) => i),
    );
    const { file, levels: places } = writeKtx2(
      sizes[0] as [number, number, number],
      channels,
      levels,
    );
    const found = read(file);
    expect([found.pixelWidth, found.pixelHeight, found.pixelDepth]).toEqual([
      5,
      3,
      channels === 4 ? 0 : 2,
    ]);
    expect([found.vkFormat, found.typeSize, found.faceCount, found.supercompressionScheme]).toEqual(
      [{ 1: 9, 2: 16, 4: 37 }[channels], 1, 1, 2],
    );
    expect(found.levels.map(({ levelData }) => zstd.decode(levelData))).toEqual(levels);
    places.forEach(({ offset, length }, i) => {
      expect(file.slice(offset, offset + length)).toEqual(found.levels[i].levelData);
    });
    const [descriptor] = found.dataFormatDescriptor;
    expect([descriptor.colorModel, descriptor.colorPrimaries, descriptor.transferFunction]).toEqual(
      [1, 1, 1],
    );
    expect(descriptor.bytesPlane[0]).toBe(channels);
    expect(
      descriptor.samples.map(({ bitOffset, bitLength, channelType }) => [
        bitOffset,
        bitLength,
        channelType,
      ]),
    ).toEqual([0, 1, 2, 15].slice(0, channels).map((type, i) => [8 * i, 7, type]));
    expect(found.keyValue.KTXwriter).toBe("StereoCell");
  });

  it("may have zstd frames of several blocks", async () => {
    const zstd = new ZSTDDecoder();
    await zstd.init();
    const data = Uint8Array.from({ length: 300_000 }, (_, i) => i * 7);
    expect(zstd.decode(storeZstd(data))).toEqual(data);
    expect(zstd.decode(storeZstd(data.subarray(0, 1)))).toEqual(data.subarray(0, 1));
  });
});

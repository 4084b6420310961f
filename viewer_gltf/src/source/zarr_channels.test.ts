import { describe, expect, it } from "vitest";
import type { NgffChannel } from "./ngff";
import { channelsOf, chooseChannels } from "./zarr_channels";

const channel = (more: Partial<NgffChannel> = {}): NgffChannel => ({
  ...{ label: null, color: null, window: null, active: null },
  ...more,
});
const read = () => Promise.reject(new Error("not read here"));

describe("the channels of an image", () => {
  it("are read up to eight, and active ones are preferred", () => {
    expect(chooseChannels([], 3)).toEqual([0, 1, 2]);
    const stated = Array.from({ length: 12 }, (_, i) => channel({ active: i > 5 }));
    expect(chooseChannels(stated, 12)).toEqual([0, 1, 6, 7, 8, 9, 10, 11]);
  });

  it("open as stated, or all together if none is active", () => {
    const stated = [channel({ active: false }), channel({ active: true }), channel()];
    const opens = (some: readonly NgffChannel[]) =>
      channelsOf(some, [...some.keys()], "uint16", read).map((one) => one.opens);
    expect(opens(stated)).toEqual([false, true, true]);
    expect(opens([channel({ active: false }), channel({ active: false })])).toEqual([true, true]);
  });

  it("have the stated window, unless it is the whole range of the number type", () => {
    const windowOf = (window: [number, number], dtype: string) =>
      channelsOf([channel({ window })], [0], dtype, read)[0].window;
    expect(windowOf([100, 1500], "uint16")).toEqual([100, 1500]);
    expect(windowOf([0, 65535], "uint16")).toBeNull();
    expect(windowOf([0, 255], "uint8")).toEqual([0, 255]);
    expect(windowOf([0, 1], "float32")).toEqual([0, 1]);
  });

  it("have unique names", () => {
    const stated = ["CD3", "cd3", "DAPI"].map((label) => channel({ label }));
    const names = channelsOf(stated, [0, 1, 2, 3], "uint8", read).map(({ name }) => name);
    expect(names).toEqual(["CD3 (channel 0)", "cd3 (channel 1)", "DAPI", "Channel3"]);
  });
});

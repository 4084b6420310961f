import { describe, expect, it } from "vitest";
import { settingsOf } from "./page_parameters";

describe("the page's address", () => {
  it("sets mode, switch distance and disc", () => {
    expect(settingsOf("?bundle=x&mode=tile&quality=high&switch=2.5&disc=20")).toEqual([
      { type: "set", id: "mode", value: "tile" },
      { type: "set", id: "quality", value: "high" },
      { type: "set", id: "switch-distance", value: 2.5 },
      { type: "set", id: "disc-radius", value: 20 },
    ]);
    expect(settingsOf("?bundle=x")).toEqual([]);
  });

  it("is reported where it can't be read", () => {
    expect(settingsOf("?mode=cube&switch=&disc=wide")).toEqual([
      {
        type: "notify",
        text: "address: mode: expected one of disc, tile, all, stage, traced, off, found cube",
      },
      { type: "notify", text: "address: switch: expected a number, found " },
      { type: "notify", text: "address: disc: expected a number, found wide" },
    ]);
  });
});

import { describe, expect, it } from "vitest";
import { settingsOf } from "./page_parameters";

describe("the page's address", () => {
  it("sets mode, switch distance and disc", () => {
    expect(settingsOf("?bundle=x&mode=tile&quality=high&switch=2.5&disc=20")).toEqual([
      { type: "choose-mode", mode: "tile" },
      { type: "choose-quality", level: "high" },
      { type: "set-switch-distance", distance_m: 2.5 },
      { type: "set-disc-radius", radius_deg: 20 },
    ]);
    expect(settingsOf("?bundle=x")).toEqual([]);
  });

  it("is told where it can't be read", () => {
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

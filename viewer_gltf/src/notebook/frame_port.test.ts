import { describe, expect, it } from "vitest";
import { embedOrigin, faultOfState } from "./frame_port";

const CHANNELS = ["dna", "cd8"];

describe("a state that a page sends to the viewer in its frame", () => {
  it("may contain any of the fields that a notebook has", () => {
    const states = [
      {},
      { link: "#mode=off" },
      { channels: { dna: { visible: false, color: "#ff0000", opacity: 0.5, window: [0, 900] } } },
      { view: { eye_um: [0, 0, 900] } },
      { picked: null },
      { picked: { point_um: [1, 2, 3], tile: "r0_c0", channel: null, object: "7" } },
    ];
    for (const state of states) expect(faultOfState(state, CHANNELS)).toBeNull();
  });

  it.each([
    [null, "state is null, expected an object"],
    [{ zoom: 3 }, "zoom is unknown, expected link, channels, view or picked"],
    [{ link: 3 }, "link is 3, expected a text"],
    [{ channels: { cd3: {} } }, "channels.cd3 is unknown, expected one of dna, cd8"],
    [{ channels: { dna: { color: "red" } } }, 'channels.dna.color is "red", expected #rrggbb'],
    [{ channels: { dna: { opacity: 2 } } }, "channels.dna.opacity is 2, expected 0 to 1"],
    [
      { channels: { dna: { gamma: 1 } } },
      "channels.dna.gamma is unknown, expected one of visible, color, opacity, window",
    ],
    [{ view: { eye_um: [0, Number.NaN, 1] } }, "view.eye_um is [0,null,1], expected three numbers"],
    [{ picked: 3 }, "picked is 3, expected an object"],
  ])("is refused with the field and what was expected: %j", (state, fault) => {
    expect(faultOfState(state, CHANNELS)).toBe(fault);
  });
});

describe("the page that may control the viewer", () => {
  it("has the origin that the address names", () => {
    expect(embedOrigin("?embed=https://lab.example")).toBe("https://lab.example");
    expect(embedOrigin("?embed=https://lab.example:8443/page")).toBe("https://lab.example:8443");
    for (const search of ["", "?embed=", "?embed=lab", "?embed=javascript:1", "?embed=*"]) {
      expect(embedOrigin(search)).toBeNull();
    }
  });
});

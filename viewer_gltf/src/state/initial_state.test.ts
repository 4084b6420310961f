import { expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { initialState } from "./initial_state";

function opening(modality: string, canTrace = true, representation: "mesh" | "volume" = "mesh") {
  const manifest = sampleManifest(1);
  return initialState(
    {
      ...manifest,
      specimen: { ...manifest.specimen, modality },
      tiles: [{ ...manifest.tiles[0], representation }],
    },
    canTrace,
  ).mode;
}

it("opens CT and MR with path tracing, or as volumes on devices that cannot trace paths", () => {
  for (const modality of ["MR", "CT"]) {
    expect(opening(modality)).toBe("traced");
    expect(opening(modality, false)).toBe("all");
  }
});

it("opens PET and SPECT as volumes, since a surface of one colour would hide the uptake", () => {
  for (const modality of ["PT", "NM"]) expect(opening(modality)).toBe("all");
});

it("opens microscopy with surfaces and the focus disc", () => {
  for (const modality of ["", "GM"]) expect(opening(modality)).toBe("disc");
});

it("opens as the stage draws it if the stage chooses volumes", () => {
  for (const modality of ["", "PT"]) expect(opening(modality, true, "volume")).toBe("stage");
});

import { expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { initialState } from "./initial_state";

function opening(modality: string, canTrace = true, representation: "mesh" | "volume" = "mesh") {
  const manifest = sampleManifest(1);
  const [first, ...others] = manifest.tiles.map((tile) => ({ ...tile, representation }));
  const specimen = { ...manifest.specimen, modality };
  return initialState({ ...manifest, specimen, tiles: [first, ...others] }, canTrace).mode;
}

it("opens scans of bodies in natural light, and as volumes on devices that cannot trace paths", () => {
  for (const modality of ["MR", "CT"]) {
    expect(opening(modality)).toBe("traced");
    expect(opening(modality, false)).toBe("all");
  }
});

it("opens PET and SPECT as volumes, since a surface of one colour would hide their heat", () => {
  for (const modality of ["PT", "NM"]) expect(opening(modality)).toBe("all");
});

it("opens volumes of microscopes with surfaces and the disc", () => {
  for (const modality of ["", "GM"]) expect(opening(modality)).toBe("disc");
});

it("opens as the stage draws it, where the stage chooses volumes", () => {
  for (const modality of ["", "PT"]) expect(opening(modality, true, "volume")).toBe("stage");
});

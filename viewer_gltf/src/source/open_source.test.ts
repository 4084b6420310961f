import { describe, expect, it } from "vitest";
import { type LocalSource, openLocal } from "./open_source";

const faultOf = (source: LocalSource) =>
  openLocal(source, () => undefined).then(
    () => "none",
    (error: Error) => error.message,
  );

describe("dropped files that the page can't read", () => {
  it.each<[string, LocalSource]>([
    ["a folder of DICOM", { kind: "folder", name: "scan", find: async () => null }],
    ["a TIFF", { kind: "file", file: new File(["II*"], "cells.tif") }],
  ])("is %s: another way is named", async (_, source) => {
    const fault = await faultOf(source);
    expect(fault).toContain("open it with stereocell view");
    expect(fault).not.toContain("host");
  });
});

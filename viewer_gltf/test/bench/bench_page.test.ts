/** The benchmark's page: a flight in every mode, on the flat screen and on the split screen, and the saved report. */
import { expect, it } from "vitest";
import type { Report } from "../../src/bench/report";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

describeInChromium("the benchmark", () => {
  const stand = prepareStand({ viewport: { width: 240, height: 160 } });

  it("times each mode and volume size with and without stereo, and saves the report", async () => {
    await stand.open("&bench=0.05");
    const { page } = stand.viewer;
    await page.locator("[data-bench=split]").click();
    await page.locator(".bench table").waitFor({ timeout: 120_000 });
    const saved = await page
      .locator("text=Save the figures")
      .evaluate(async (link) => (await fetch((link as HTMLAnchorElement).href)).text());
    const report: Report = JSON.parse(saved);
    expect(report.format).toBe("stereocell-fps");
    expect(report.device.renderer).toMatch(/llvmpipe|SwiftShader/);
    expect(report.tiles).toBe(stand.manifest.tiles.length);
    expect(JSON.stringify(report)).not.toContain(stand.manifest.specimen.name);
    const made = report.runs.map(({ mode, eyes }) => `${mode} ${eyes}`);
    for (const eyes of ["split", "mono"]) {
      for (const mode of ["mesh", "disc", "all", "traced"])
        expect(made).toContain(`${mode} ${eyes}`);
    }
    for (const { mode, eyes, edge, frames, median_ms, p95_ms, ...cost } of report.runs) {
      const name = `${mode}, ${eyes}, ${edge}`;
      expect(frames, name).toBeGreaterThanOrEqual(6);
      expect(median_ms, name).toBeGreaterThan(0);
      expect(p95_ms, name).toBeGreaterThanOrEqual(median_ms);
      expect(edge === null, name).toBe(mode === "mesh");
      // The specimen is visible during the flight.
      if (mode === "mesh") expect(cost.triangles, name).toBeGreaterThan(0);
      else expect(cost.volumeBytes, name).toBeGreaterThan(0);
    }
    const triangles = (eyes: string) =>
      report.runs.find((run) => run.mode === "mesh" && run.eyes === eyes)?.triangles;
    expect(triangles("split")).toBe(triangles("mono"));
    expect((await stand.viewer.snapshot()).isStereo).toBe(false);
  });
});

import { describe, expect, it } from "vitest";
import { reachesOf } from "./reach";

const chainsOf = (text: string) => reachesOf("part.ts", text).map(({ chain }) => chain);

describe("a part", () => {
  it("may use members of the host at most two dots away", () => {
    expect(chainsOf("host.viewpoint.lookFrom(view);")).toEqual([]);
    expect(chainsOf("host.display.viewpoint.lookFrom(view);")).toEqual([
      "host.display.viewpoint.lookFrom",
    ]);
    expect(chainsOf("class A { go() { this.host.display?.stereo?.end(); } }")).toEqual([
      "host.display.stereo.end",
    ]);
  });

  it("may not reach farther by destructuring the host", () => {
    const patterns = [
      "const { display } = host; display.stereo.end();",
      "const { stereo } = host.display; stereo.end();",
      "const { display: { stereo } } = host; const { end } = stereo;",
      "const it = host.display; const eyes = it.stereo; eyes.end();",
      "class A { go() { const { host } = this; host.display.stereo.end(); } }",
      "function go({ display }: PartHost) { display.stereo.end(); }",
      "const go = (of: PartHost) => of.display.stereo.end();",
    ];
    for (const text of patterns) expect(chainsOf(text), text).toEqual(["host.display.stereo.end"]);
  });

  it("may read plain data to any depth", () => {
    expect(chainsOf("host.bundle.manifest.specimen.name.length;")).toEqual([]);
    expect(chainsOf("const { manifest } = host.bundle; manifest.specimen.bounds_um;")).toEqual([]);
    expect(chainsOf("host.panel.view.open.length;")).toEqual([]);
  });

  it("may use the result of a call, and objects that do not belong to the host", () => {
    expect(chainsOf('host.service("page")?.focus("share", "link");')).toEqual([]);
    expect(chainsOf("window.display.stereo.end(); this.options.a.b.c;")).toEqual([]);
    expect(chainsOf("function go(host: string) { host.length; }")).toEqual([]);
    expect(chainsOf("const { display } = other; display.stereo.end();")).toEqual([]);
    expect(
      chainsOf("function go(display) { display.stereo.end.now(); } const { display } = host;"),
    ).toEqual([]);
  });

  it("is reported with the line", () => {
    expect(reachesOf("part.ts", "\n\nhost.a.b.c();")).toEqual([{ line: 3, chain: "host.a.b.c" }]);
  });
});

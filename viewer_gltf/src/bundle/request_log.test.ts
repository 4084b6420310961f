import { expect, it, vi } from "vitest";

it("notes each address and range once, until the notes are taken", async () => {
  vi.resetModules(); // others of this process may have taken theirs
  const { noteAsked, takeAsked } = await import("./request_log");
  noteAsked("https://host/a", undefined);
  noteAsked("https://host/a", {});
  noteAsked("https://host/a", { Range: "bytes=0-9" });
  noteAsked("https://host/a", { range: "bytes=0-9" });
  expect(takeAsked()).toEqual([
    { url: "https://host/a", range: null },
    { url: "https://host/a", range: "bytes=0-9" },
  ]);
  noteAsked("https://host/b", undefined);
  expect(takeAsked()).toEqual([]);
});

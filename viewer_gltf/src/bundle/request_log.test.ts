import { expect, it, vi } from "vitest";

it("the request log has each address and range once, and whether it was answered", async () => {
  vi.resetModules(); // other tests of this process have added to the log
  const { noteAsked, allAsked, allAnswered } = await import("./request_log");
  noteAsked("https://host/a", undefined);
  noteAsked("https://host/a", { Range: "bytes=0-9" });
  noteAsked("https://host/a", { range: "bytes=0-9" }, true);
  noteAsked("https://host/a", { range: "bytes=0-9" });
  expect(allAsked()).toEqual([
    { url: "https://host/a", range: null },
    { url: "https://host/a", range: "bytes=0-9" },
  ]);
  expect(allAnswered()).toEqual([{ url: "https://host/a", range: "bytes=0-9" }]);
});

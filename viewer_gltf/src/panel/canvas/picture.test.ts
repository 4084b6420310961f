import { describe, expect, it, vi } from "vitest";
import type { Picture, Request } from "../controls";
import { paint } from "./paint";
import { pictureBlock } from "./picture";

const request = (x: number, y: number): Request => ({ panel: "find", text: `${x} ${y}` });
const PICTURE: Picture = {
  kind: "picture",
  id: "cells/histogram",
  label: "CD8",
  height: 0.25,
  version: "1",
  text: "all",
  draw: () => undefined,
  press: request,
};

describe("a picture on the panel's canvas", () => {
  it("has its share of the width as its height, up to the height of a page", () => {
    const rectOf = (height: number) => pictureBlock({ ...PICTURE, height }, 832).marks[1].rect;
    expect(rectOf(0.25)).toMatchObject({ x: 16, width: 800, height: 200 });
    expect(rectOf(3).height).toBe(480);
  });

  it("is pressed at the place that a ray meets, and dragged if it can be", () => {
    const [pressed] = pictureBlock(PICTURE, 832).regions;
    expect(pressed.isSlide).toBe(false);
    expect(pressed.to(0.25, 0.5)).toEqual(request(0.25, 0.5));
    const drag = vi.fn(() => null);
    const [dragged] = pictureBlock({ ...PICTURE, drag }, 832).regions;
    expect(dragged.isSlide).toBe(true);
    expect(dragged.press?.(0.1, 0.2)).toEqual(request(0.1, 0.2));
    expect(dragged.to(0.3, 0.4)).toBeNull();
    expect(drag).toHaveBeenCalledWith(0.3, 0.4);
  });

  it("is drawn in its place by its owner, with the canvas state restored", () => {
    const draw = vi.fn();
    const context = { save: vi.fn(), translate: vi.fn(), restore: vi.fn() };
    const { marks } = pictureBlock({ ...PICTURE, draw }, 832);
    const own = marks.filter(({ kind }) => kind === "picture");
    paint(context as unknown as CanvasRenderingContext2D, own);
    expect(context.translate).toHaveBeenCalledWith(16, own[0].rect.y);
    expect(draw).toHaveBeenCalledWith(context, 800, 200);
    expect(context.restore).toHaveBeenCalledTimes(1);
  });

  it("refuses with a reason", () => {
    const [region] = pictureBlock({ ...PICTURE, refusal: "Not now." }, 832).regions;
    expect(region.to(0, 0)).toEqual({ canvas: "announce", text: "Not now." });
  });
});

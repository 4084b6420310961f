/** Volumes as bricks streamed by view, from a host that offers them. */
import { Data3DTexture, RedFormat, Vector3, type WebGLRenderer } from "three";
import { BrickTile } from "./brick_atlas";
import { BrickLink } from "./client";
import type { BrickView } from "./protocol";
import { STORED } from "./tree";

export class BrickService {
  private readonly link: BrickLink;
  /** Tiles that are not available as bricks; their volumes are loaded as files. */
  private readonly refused = new Set<string>();
  private readonly brick = new Data3DTexture(null, STORED, STORED, STORED);
  private readonly corner = new Vector3();

  constructor(
    private readonly renderer: WebGLRenderer,
    address: string,
    onChange: () => void,
    onError: (error: unknown) => void,
  ) {
    this.brick.format = RedFormat;
    this.brick.unpackAlignment = 1;
    this.link = new BrickLink(address, onChange, onError);
  }

  get isBusy(): boolean {
    return this.link.isBusy;
  }

  /** The tile as bricks; null if it is loaded as files. */
  tile(
    tile: string,
    limits: Readonly<{ bytes: number; side: number }>,
    onChange: () => void,
    onRefused: () => void,
  ): BrickTile | null {
    if (!this.link.isOpen || this.refused.has(tile)) return null;
    const refuse = () => {
      this.refuse(tile);
      onRefused();
    };
    return new BrickTile(tile, this.link, limits, this.upload, onChange, refuse);
  }

  /** Loads the tile as files from now on. */
  refuse(tile: string): void {
    this.refused.add(tile);
  }

  look(view: BrickView): void {
    this.link.look(view, performance.now());
  }

  private readonly upload = (
    atlas: Data3DTexture,
    [x, y, z]: readonly number[],
    texels: Uint8Array,
  ) => {
    this.brick.image.data = texels;
    this.brick.needsUpdate = true;
    this.renderer.copyTextureToTexture(this.brick, atlas, null, this.corner.set(x, y, z));
  };

  dispose(): void {
    this.link.dispose();
    this.brick.dispose();
  }
}

/**
 * Writes frames of a canvas as a video with the browser's own encoder, or as PNG files in a zip if it has none.
 */
import { type EncodedFrame, writeWebm } from "./webm";

export const FRAMES_PER_S = 30;
/** Bits per pixel of a frame; enough to keep fine lines sharp. */
const BITS_PER_PIXEL = 0.25;
const KEY_EVERY = 60;
/** Largest number of frames that wait for the encoder. */
const MAX_WAITING = 4;

export type FilmedFile = Readonly<{ content: Blob; suffix: "webm" | "zip" }>;

export interface FrameWriter {
  add(canvas: HTMLCanvasElement): Promise<void>;
  finish(): Promise<FilmedFile>;
  /** Cancels the video. */
  close(): void;
}

/** @param width even, like the height */
export async function frameWriter(width: number, height: number): Promise<FrameWriter> {
  const config: VideoEncoderConfig = {
    codec: "vp8",
    width,
    height,
    framerate: FRAMES_PER_S,
    bitrate: Math.round(width * height * FRAMES_PER_S * BITS_PER_PIXEL),
  };
  // Outside a secure context there is no encoder, although the types claim that there always is one.
  const isThere = typeof VideoEncoder !== "undefined" && typeof VideoFrame !== "undefined";
  const support = isThere ? await VideoEncoder.isConfigSupported(config).catch(() => null) : null;
  return support?.supported === true ? new VideoWriter(config) : new ZipWriter();
}

class VideoWriter implements FrameWriter {
  private readonly frames: EncodedFrame[] = [];
  private readonly encoder: VideoEncoder;
  private count = 0;
  private fault: DOMException | null = null;

  constructor(private readonly config: VideoEncoderConfig) {
    this.encoder = new VideoEncoder({
      output: (chunk) => {
        const data = new Uint8Array(chunk.byteLength);
        chunk.copyTo(data);
        this.frames.push({ data, time_ms: chunk.timestamp / 1000, isKey: chunk.type === "key" });
      },
      error: (error) => {
        this.fault = error;
      },
    });
    this.encoder.configure(config);
  }

  async add(canvas: HTMLCanvasElement): Promise<void> {
    const timestamp = Math.round((this.count * 1e6) / FRAMES_PER_S);
    const frame = new VideoFrame(canvas, { timestamp });
    if (this.fault !== null) throw this.fault;
    this.encoder.encode(frame, { keyFrame: this.count % KEY_EVERY === 0 });
    frame.close();
    this.count++;
    while (this.encoder.encodeQueueSize > MAX_WAITING && this.fault === null) {
      await new Promise((resolve) => setTimeout(resolve, 5));
    }
  }

  async finish(): Promise<FilmedFile> {
    await this.encoder.flush();
    if (this.fault !== null) throw this.fault;
    this.encoder.close();
    const { width, height } = this.config;
    const frame_ms = 1000 / FRAMES_PER_S;
    const file = writeWebm({ codec: "V_VP8", width, height, frame_ms }, this.frames);
    return { content: new Blob([file], { type: "video/webm" }), suffix: "webm" };
  }

  close(): void {
    if (this.encoder.state !== "closed") this.encoder.close();
  }
}

class ZipWriter implements FrameWriter {
  private readonly files: Record<string, Uint8Array<ArrayBuffer>> = {};
  private count = 0;

  async add(canvas: HTMLCanvasElement): Promise<void> {
    const png = await pngOf(canvas);
    const name = `frame-${String(this.count++).padStart(4, "0")}.png`;
    this.files[name] = new Uint8Array(await png.arrayBuffer());
  }

  async finish(): Promise<FilmedFile> {
    const { zipSync } = await import("three/examples/jsm/libs/fflate.module.js");
    const zip = zipSync(this.files, { level: 0 }); // PNG files are already compressed
    const content = new Blob([new Uint8Array(zip)], { type: "application/zip" });
    return { content, suffix: "zip" };
  }

  close(): void {
    for (const name of Object.keys(this.files)) delete this.files[name];
  }
}

/** Returns a canvas as a PNG file. Rejects if the browser has too little memory. */
export function pngOf(canvas: HTMLCanvasElement): Promise<Blob> {
  return new Promise((resolve, reject) => {
    canvas.toBlob((blob) => {
      if (blob !== null) resolve(blob);
      else reject(new DOMException("no picture of this size can be made here", "EncodingError"));
    }, "image/png");
  });
}

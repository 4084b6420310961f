/** Runs a shader chunk as a small program: a fragment shader of few pixels that outputs numbers. */
import { readFile } from "node:fs/promises";
import type { Page } from "playwright-core";
import { includeChunks } from "../../../src/gpu/glsl_include";

/** Precisions that three.js puts before each shader. Without them, samplers may have few bits. */
const PRECISION = ["float", "int", "sampler2D", "sampler3D", "sampler2DArray", "usampler3D"]
  .map((type) => `precision highp ${type};\n`)
  .join("");
const CHUNKS = new URL("../../../src/gpu/chunks/", import.meta.url);

export async function readChunks(...names: string[]): Promise<Record<string, string>> {
  const read = async (name: string) =>
    [`chunks/${name}`, await readFile(new URL(`${name}.glsl`, CHUNKS), "utf8")] as const;
  return Object.fromEntries(await Promise.all(names.map(read)));
}

/** A 2D or 3D texture of bytes or floats, nearest unless linear; `size` has two or three components. */
export type Texture = Readonly<{
  size: readonly number[];
  channels: 1 | 4;
  texels: number[];
  isLinear?: boolean;
  isFloat?: boolean;
}>;

/**
 * Runs a program and returns `oColor`, averaged over the pixels.
 *
 * @param head declarations, with `#include <chunks/...>` lines
 * @param body body of main()
 * @param uniforms textures and vec4s
 * @param pixels several share a long loop; Mesa allows 65 535 turns for one
 */
export async function runProgram(
  page: Page,
  chunks: Record<string, string>,
  head: string,
  body: string,
  uniforms: Readonly<Record<string, Texture | readonly number[]>> = {},
  pixels = 1,
): Promise<readonly number[]> {
  const source = `#version 300 es\n${PRECISION}out vec4 oColor;\n${head}\nvoid main() {\n${body}\n}`;
  return page.evaluate(
    ({ fragment, uniforms, pixels }) => {
      const gl = document.createElement("canvas").getContext("webgl2");
      if (gl === null) throw new Error("no WebGL 2");
      if (gl.getExtension("EXT_color_buffer_float") === null) throw new Error("no float target");
      const program = gl.createProgram();
      const vertex = `#version 300 es
        void main() {
          float x = (2.0 * float(gl_VertexID) + 1.0) / ${pixels}.0 - 1.0;
          gl_Position = vec4(x, 0, 0, 1);
          gl_PointSize = 1.0;
        }`;
      for (const [type, text] of [
        [gl.VERTEX_SHADER, vertex],
        [gl.FRAGMENT_SHADER, fragment],
      ] as const) {
        const shader = gl.createShader(type);
        if (shader === null) throw new Error("no shader");
        gl.shaderSource(shader, text);
        gl.compileShader(shader);
        const log = gl.getShaderInfoLog(shader);
        if (log) throw new Error(log);
        gl.attachShader(program, shader);
      }
      gl.linkProgram(program);
      gl.useProgram(program);
      const bind = (unit: number, target: number, isLinear = false) => {
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(target, gl.createTexture());
        for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
          gl.texParameteri(target, filter, isLinear ? gl.LINEAR : gl.NEAREST);
        }
        for (const way of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) {
          gl.texParameteri(target, way, gl.CLAMP_TO_EDGE);
        }
      };
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
      Object.entries(uniforms).forEach(([name, given], unit) => {
        if (!("size" in given)) {
          gl.uniform4fv(gl.getUniformLocation(program, name), given);
          return;
        }
        const { size, channels, texels, isLinear, isFloat } = given;
        const format = channels === 1 ? gl.RED : gl.RGBA;
        const floats = channels === 1 ? gl.R32F : gl.RGBA32F;
        const inside = isFloat ? floats : channels === 1 ? gl.R8 : gl.RGBA8;
        const [w, h, d] = size;
        const bytes = isFloat ? Float32Array.from(texels) : Uint8Array.from(texels);
        const type = isFloat ? gl.FLOAT : gl.UNSIGNED_BYTE;
        if (d === undefined) {
          bind(unit, gl.TEXTURE_2D, isLinear);
          gl.texImage2D(gl.TEXTURE_2D, 0, inside, w, h, 0, format, type, bytes);
        } else {
          bind(unit, gl.TEXTURE_3D, isLinear);
          gl.texImage3D(gl.TEXTURE_3D, 0, inside, w, h, d, 0, format, type, bytes);
        }
        gl.uniform1i(gl.getUniformLocation(program, name), unit);
      });
      bind(15, gl.TEXTURE_2D);
      const target = gl.getParameter(gl.TEXTURE_BINDING_2D) as WebGLTexture;
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, pixels, 1);
      gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
      gl.viewport(0, 0, pixels, 1);
      gl.drawArrays(gl.POINTS, 0, pixels);
      const numbers = new Float32Array(4 * pixels);
      gl.readPixels(0, 0, pixels, 1, gl.RGBA, gl.FLOAT, numbers);
      const mean = [0, 0, 0, 0];
      numbers.forEach((v, i) => {
        mean[i % 4] += v / pixels;
      });
      return mean;
    },
    { fragment: includeChunks(source, chunks), uniforms, pixels },
  );
}

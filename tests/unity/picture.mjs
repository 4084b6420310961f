// Draws boxes with the Unity shader in headless Chromium. glslang and SPIRV-Cross have converted the shader to WebGL 2.
// Standard input is JSON with the shader, and with the uniforms' bytes and the textures of each box. Standard output has
// the pixels as RGBA floats.
import { chromium } from "playwright-core";

const [path] = process.argv.slice(1);
const chunks = [];
for await (const chunk of process.stdin) chunks.push(chunk);
const asked = Buffer.concat(chunks).toString();
const args = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const browser = await chromium.launch({ executablePath: path, args: [...args, "--no-sandbox", "--ignore-gpu-blocklist"] });
const page = await browser.newPage();
page.on("console", (message) => console.error(message.text()));
const found = await page.evaluate((asked) => {
  const { vertex, fragment, blocks, samplers, width, height, boxes } = JSON.parse(asked);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const canvas = document.createElement("canvas");
  const gl = canvas.getContext("webgl2");
  gl.getExtension("EXT_color_buffer_float");
  gl.getExtension("EXT_float_blend");
  const program = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.bindAttribLocation(program, 0, "vertex_position");
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);
  blocks.forEach((name, i) => {
    gl.uniformBlockBinding(program, gl.getUniformBlockIndex(program, name), i);
  });
  gl.uniform1i(gl.getUniformLocation(program, samplers._Volume), 0);
  gl.uniform1i(gl.getUniformLocation(program, samplers._Table), 1);
  gl.uniform1i(gl.getUniformLocation(program, samplers._CameraDepthTexture), 2);

  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, height);
  const target = gl.getParameter(gl.TEXTURE_BINDING_2D);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
  gl.viewport(0, 0, width, height);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT);
  // The state of the shader's pass: Cull Front, with clockwise front faces as in Unity, and Blend One OneMinusSrcAlpha.
  gl.enable(gl.CULL_FACE);
  gl.frontFace(gl.CW);
  gl.cullFace(gl.FRONT);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);

  const upload = (unit, dimensions, { size: [x, y, z], format, texels }) => {
    const [inside, outside] = { R8: [gl.R8, gl.RED], RG16: [gl.RG8, gl.RG], RGBA32: [gl.RGBA8, gl.RGBA] }[format];
    const at = dimensions === 3 ? gl.TEXTURE_3D : gl.TEXTURE_2D;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(at, gl.createTexture());
    if (dimensions === 3) gl.texImage3D(at, 0, inside, x, y, z, 0, outside, gl.UNSIGNED_BYTE, bytes(texels));
    else gl.texImage2D(at, 0, inside, x, y, 0, outside, gl.UNSIGNED_BYTE, bytes(texels));
    for (const name of ["MIN_FILTER", "MAG_FILTER"]) gl.texParameteri(at, gl[`TEXTURE_${name}`], gl.LINEAR);
    for (const name of ["S", "T", "R"]) gl.texParameteri(at, gl[`TEXTURE_WRAP_${name}`], gl.CLAMP_TO_EDGE);
  };
  upload(2, 2, { size: [1, 1, 1], format: "R8", texels: btoa("\u00ff") }); // a depth of 1 everywhere
  for (const { uniforms, volume, table, vertices, triangles } of boxes) {
    upload(0, 3, volume);
    upload(1, 2, table);
    uniforms.forEach((data, i) => {
      gl.bindBufferBase(gl.UNIFORM_BUFFER, i, gl.createBuffer());
      gl.bufferData(gl.UNIFORM_BUFFER, bytes(data), gl.STATIC_DRAW);
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(vertices.flat()), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(triangles), gl.STATIC_DRAW);
    gl.drawElements(gl.TRIANGLES, triangles.length, gl.UNSIGNED_SHORT, 0);
  }
  const pixels = new Float32Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, pixels);
  if (gl.getError() !== 0) throw new Error("WebGL has failed");
  return Array.from(pixels);
}, asked);
await browser.close();
process.stdout.write(Buffer.from(new Float32Array(found).buffer));

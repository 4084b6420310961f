// Moves a vertex of an eye's image to where the lens shows it undistorted. Clip space.
in vec2 aImage;  // position within this eye's own image, 0 to 1

out vec2 vUv;  // position within the render target, which holds both eyes
out vec2 vImage;

void main() {
  gl_Position = vec4(position.xy, 0.0, 1.0);
  vUv = uv;
  vImage = aImage;
}

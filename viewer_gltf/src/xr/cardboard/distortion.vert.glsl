// A vertex of an eye's picture, moved to where the lens shows it straight. Clip space.
in vec2 aPicture;  // within the eye's own picture, 0 to 1

out vec2 vUv;       // within the target, which holds both eyes
out vec2 vPicture;

void main() {
  gl_Position = vec4(position.xy, 0.0, 1.0);
  vUv = uv;
  vPicture = aPicture;
}

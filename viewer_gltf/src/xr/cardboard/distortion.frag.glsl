uniform sampler2D uEyes;  // encoded colours, as the canvas has them

in vec2 vUv;
in vec2 vImage;
out vec4 oColor;

// Share of the image's width and height over which the edge fades to black.
const float EDGE = 0.02;

void main() {
  vec2 inside = smoothstep(0.0, EDGE, min(vImage, 1.0 - vImage));
  oColor = vec4(texture(uEyes, vUv).rgb * inside.x * inside.y, 1.0);
}

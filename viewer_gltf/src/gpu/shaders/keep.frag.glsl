// Copies one image.
precision highp float;

uniform sampler2D uLight;

out vec4 oColor;

void main() {
  oColor = texelFetch(uLight, ivec2(gl_FragCoord.xy), 0);
}

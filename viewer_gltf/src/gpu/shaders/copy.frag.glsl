// Copies two images.
precision highp float;

uniform sampler2D uFirst;
uniform sampler2D uSecond;

layout(location = 0) out vec4 oFirst;
layout(location = 1) out vec4 oSecond;

void main() {
  oFirst = texelFetch(uFirst, ivec2(gl_FragCoord.xy), 0);
  oSecond = texelFetch(uSecond, ivec2(gl_FragCoord.xy), 0);
}

// The mean colour of the sums, and the guide by which the denoiser compares pixels.
precision highp float;

uniform sampler2D uSums;
uniform sampler2D uMoments;
uniform float uEdge;  // um, the box's longest edge; distances are divided by it, because half floats end at 65504
uniform float uOcclusion;  // 0..1: how much enclosed places are darkened

layout(location = 0) out vec4 oColor;  // linear, premultiplied
layout(location = 1) out vec4 oGuide;  // distance in edges, samples, standard error of the luminance, 0

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 sums = texelFetch(uSums, at, 0);
  vec4 moments = texelFetch(uMoments, at, 0);
  float n = max(moments.y, 1e-6);
  vec4 mean = sums / n;
  float coverage = max(sums.a, 1e-6);
  mean.rgb *= mix(1.0, moments.w / coverage, uOcclusion);
  float luminance = dot(sums.rgb, vec3(0.2126, 0.7152, 0.0722)) / n;
  float error = sqrt(max(moments.x / n - luminance * luminance, 0.0) / max(n - 1.0, 1.0));
  oColor = mean;
  oGuide = vec4(sums.a > 0.0 ? moments.z / coverage / uEdge : 0.0, moments.y, error, 0.0);
}

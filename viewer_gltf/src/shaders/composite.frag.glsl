// Lay the marched picture over the scene. Where it was marched at fewer pixels, each pixel mixes
// the four around it by nearness, and by how alike the depth of the scene is there, so that colour
// does not bleed over a surface's edge (joint bilateral upsampling, Kopf et al., SIGGRAPH 2007).
precision highp float;

uniform sampler2D uMarched;  // premultiplied, encoded
uniform sampler2D uSceneDepth;
uniform float uScale;  // pixels of uMarched to one of the picture

out vec4 oColor;

const float ALIKE = 0.02;  // of the depth's distance to the far plane

void main() {
  if (uScale >= 1.0) {
    oColor = texelFetch(uMarched, ivec2(gl_FragCoord.xy), 0);
    return;
  }
  ivec2 lastDepth = textureSize(uSceneDepth, 0) - 1;
  ivec2 last = textureSize(uMarched, 0) - 1;
  float here = 1.0 - texelFetch(uSceneDepth, ivec2(gl_FragCoord.xy), 0).r;
  vec2 at = gl_FragCoord.xy * uScale - 0.5;
  vec2 corner = floor(at);
  vec2 part = at - corner;
  vec4 sum = vec4(0.0);
  float total = 0.0;
  for (int i = 0; i < 4; i++) {
    vec2 tap = corner + vec2(i & 1, i >> 1);
    ivec2 source = ivec2((tap + 0.5) / uScale);
    float there = 1.0 - texelFetch(uSceneDepth, clamp(source, ivec2(0), lastDepth), 0).r;
    vec2 near = mix(1.0 - part, part, vec2(i & 1, i >> 1));
    float alike = abs(there - here) <= ALIKE * max(there, here) ? 1.0 : 1e-3;
    float weight = (near.x * near.y + 1e-4) * alike;
    sum += weight * texelFetch(uMarched, clamp(ivec2(tap), ivec2(0), last), 0);
    total += weight;
  }
  oColor = sum / total;
}

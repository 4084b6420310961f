// March up to CHANNELS volumes of one tile together, front to back.
// Space of the ray: um from the box's low corner, y up, so anisotropic voxels need no care.
// After Engel et al., Real-Time Volume Graphics (2006): opacity correction, early termination.
precision highp float;
precision highp sampler3D;

uniform vec3 uSize;  // um
uniform vec3 uTexLow;  // texture coordinates at the box's low corner ...
uniform vec3 uTexHigh;  // ... and at its high corner
uniform vec3 uTexels;  // of mip level 0
uniform float uVoxel;  // um: the opacities of the transfer functions hold for a path this long
uniform float uMinStep;  // um
uniform float uBrickSlack;  // bricks by which a coarse mip level smears beyond its brick
uniform vec3 uColor[CHANNELS];  // linear RGB
uniform sampler3D uVolume0;
uniform sampler3D uVolume1;
uniform sampler3D uVolume2;
uniform sampler3D uVolume3;
uniform sampler3D uOccupancy;  // bricks to the nearest visible one / 255
uniform sampler2D uLut;  // 256 x CHANNELS: RGB factor to the colour, A opacity a voxel
uniform sampler2D uSceneDepth;

// At a sample that is covered: else rays at a tile's rim would miss the tile and leave a seam.
centroid in vec3 vPosition;
flat in vec3 vEye;
flat in vec3 vLight;
flat in vec2 vDepth;
centroid in float vViewZ;

out vec4 oColor;  // premultiplied

#include <chunks/intersect_box>
#include <chunks/scene_distance>
#include <chunks/leap>
#include <chunks/intensities>
#include <chunks/classify>
#include <chunks/shade>
#include <chunks/jitter>

void main() {
  vec3 ray = vPosition - vEye;
  float back = length(ray);
  vec3 dir = ray / back;
  vec3 invDir = 1.0 / (dir + 1e-6 * vec3(equal(dir, vec3(0.0))));
  vec2 span = intersectBox(vEye, invDir, uSize);
  vec3 scene = sceneDistances(back);
  float edge = min(span.y, scene.x);
  float end = min(span.y, scene.y);
  float t = max(span.x, 0.0);

  vec3 texPerUm = (uTexHigh - uTexLow) / uSize;
  vec3 texEye = uTexLow + vEye * texPerUm;
  vec3 texDir = dir * texPerUm;
  vec4 sum = vec4(0.0);
  vec4 veil = vec4(0.0);  // the sum in front of the edge
  float shift = jitter(gl_FragCoord.xy);
  int i = 0;
  for (; i < MAX_STEPS && t < end && sum.a < OPAQUE; i++) {
    // What remains of the ray over what remains of the budget: it always reaches the end.
    float dt = max(uMinStep, (end - t) / float(MAX_STEPS - i));
    float leap = leapLength(texEye + t * texDir, texDir);
    if (leap > 0.0) {
      t += leap;
      continue;
    }
    bool isInFront = t < edge;
    float here = min(dt, (isInFront ? edge : end) - t);  // the last step may be shorter
    vec3 p = texEye + (t + shift * here) * texDir;
    vec4 s = classify(sampleIntensities(p), here / uVoxel);
    if (s.a > 0.0) {
      s.rgb *= shade(p, texPerUm, dir);
      sum += (1.0 - sum.a) * vec4(s.rgb * s.a, s.a);
    }
    if (isInFront) veil = sum;
    t += here;
  }
#ifdef COUNT_STEPS  // for tests: the number of steps, and the share of the ray that they covered
  oColor = vec4(float(i % 256) / 255.0, float(i / 256) / 255.0, clamp(t / end, 0.0, 1.0), 1.0);
  return;
#endif
  sum = mix(veil, sum, scene.z);
  if (sum.a <= 0.0) discard;
  // Blending happens on encoded colours, as for every other surface of the page.
  oColor = vec4(linearToOutputTexel(vec4(sum.rgb / sum.a, 1.0)).rgb * sum.a, sum.a);
}

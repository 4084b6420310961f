// March the volume of one tile, up to CHANNELS channels together, front to back.
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
uniform int uSteps;  // for the whole ray, at most MAX_STEPS
uniform int uSpare;  // of these, one for each other tile
uniform vec3 uAllLow;  // um, the same space: the box around all tiles that are marched ...
uniform vec3 uAllHigh;  // ... which share the ray's steps by length
uniform float uBrickSlack;  // bricks by which a coarse mip level smears beyond its brick
uniform vec3 uColor[CHANNELS];  // linear RGB
uniform bvec4 uInDisc;  // which channels show in the disc alone
uniform vec3 uApex;  // um: the disc is a cone from here ...
uniform vec3 uAxis;  // ... along this unit vector
uniform vec2 uDisc;  // cosines of its inner and outer radius
uniform float uPresence;  // 0..1: volumes fade in once they have come
uniform vec3 uClipLow;  // um: nothing outside is drawn
uniform vec3 uClipHigh;
uniform vec4 uClipPlane;  // xyz unit normal, w um: nothing with dot(normal, p) > w is drawn
uniform sampler3D uVolume;
uniform sampler3D uOldVolume;  // what the volume takes the place of, at another mip level
uniform float uFresh;  // 0..1: share of the new one
uniform sampler3D uOccupancy;  // bricks to the nearest visible one / 255
uniform sampler2D uLut;  // 256 x CHANNELS: RGB factor to the colour, A opacity a voxel
uniform sampler2D uSceneDepth;
uniform sampler2D uNoise;  // blue noise
uniform float uScale;  // pixels here to one of the picture
uniform vec2 uOrigin;  // of the eye's picture, in these pixels

// At a sample that is covered: else rays at a tile's rim would miss the tile and leave a seam.
centroid in vec3 vPosition;
flat in vec3 vEye;
flat in vec3 vLight;
flat in vec2 vDepth;
centroid in float vViewZ;

out vec4 oColor;  // premultiplied

#include <chunks/intersect_box>
#include <chunks/clip_span>
#include <chunks/disc>
#include <chunks/cone_span>
#include <chunks/scene_distance>
#include <chunks/leap>
#include <chunks/intensities>
#include <chunks/classify>
#include <chunks/shade>
#include <chunks/jitter>
#include <chunks/encoded>

void main() {
  vec3 ray = vPosition - vEye;
  float back = length(ray);
  vec3 dir = ray / back;
  vec3 invDir = 1.0 / (dir + 1e-6 * vec3(equal(dir, vec3(0.0))));
  vec2 span = intersectBox(vEye, invDir, vec3(0.0), uSize);
  span.x = max(span.x, 0.0);
  vec2 all = intersectBox(vEye, invDir, uAllLow, uAllHigh);
  float share = (span.y - span.x) / max(all.y - max(all.x, 0.0), 1e-6);
  int steps = max(1, int(min(1.0, share) * float(uSteps - uSpare) + 1e-3));
  span = clipSpan(span, vEye, dir, invDir);
  bvec4 unused = bvec4(CHANNELS < 1, CHANNELS < 2, CHANNELS < 3, CHANNELS < 4);
  bvec4 bound = bvec4(uInDisc.x || unused.x, uInDisc.y || unused.y,
                      uInDisc.z || unused.z, uInDisc.w || unused.w);
  if (all4(bound)) span = coneSpan(span, vEye, dir);
  vec3 scene = sceneDistances(back);
  float edge = min(span.y, scene.x);
  float end = min(span.y, scene.y);
  float t = span.x;
  if (t >= end) discard;

  vec3 texPerUm = (uTexHigh - uTexLow) / uSize;
  vec3 texEye = uTexLow + vEye * texPerUm;
  vec3 texDir = dir * texPerUm;
  vec4 sum = vec4(0.0);
  vec4 veil = vec4(0.0);  // the sum in front of the edge
  float shift = jitter(gl_FragCoord.xy - uOrigin);
  int i = 0;
  for (; i < MAX_STEPS && i < steps && t < end && sum.a < OPAQUE; i++) {
    // What remains of the ray over what remains of the budget: it always reaches the end.
    float dt = max(uMinStep, (end - t) / float(steps - i));
    float leap = leapLength(texEye + t * texDir, texDir);
    if (leap > 0.0) {
      t += leap;
      continue;
    }
    bool isInFront = t < edge;
    float here = min(dt, (isInFront ? edge : end) - t);  // the last step may be shorter
    float at = t + shift * here;
    vec3 p = texEye + at * texDir;
    vec4 s = classify(sampleIntensities(p), here / uVoxel * weights(vEye + at * dir));
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
  oColor = vec4(encoded(sum.rgb / sum.a) * sum.a, sum.a);
}

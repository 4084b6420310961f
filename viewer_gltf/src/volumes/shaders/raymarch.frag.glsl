// March the volume of one tile, up to CHANNELS channels together, front to back. What lies in front
// of the nearest translucent surface, a pane, and what lies behind it come out apart: the pane itself
// is drawn between them.
// Space of the ray: um from the box's low corner, y up, so anisotropic voxels need no care.
// After Engel et al., Real-Time Volume Graphics (2006): opacity correction, early termination.
precision highp float;
precision highp sampler3D;
precision highp sampler2DArray;
precision highp usampler3D;

uniform vec3 uSize;  // um
uniform vec3 uTexLow;  // texture coordinates at the box's low corner ...
uniform vec3 uTexHigh;  // ... and at its high corner
uniform vec3 uTexels;  // of mip level 0
uniform float uVoxel;  // um: the opacities of the transfer functions hold for a path this long
uniform float uDensity;  // ... times this
uniform float uMinStep;  // um
uniform vec4 uFloor;  // intensities of each channel up to which its table shows nothing
uniform vec4 uContrast;  // factor to the gradients of each channel, by which they are shaded
#ifdef MAXIMUM
uniform vec4 uWindowLow;  // intensities of each channel that are dark ...
uniform vec4 uWindowHigh;  // ... and bright
#endif
uniform int uSteps;  // for the whole ray, at most MAX_STEPS
uniform int uSpare;  // of these, one for each other tile
uniform vec3 uAllLow;  // um, the same space: the box around all tiles that are marched ...
uniform vec3 uAllHigh;  // ... which share the ray's steps by length
uniform float uBrickSlack;  // bricks by which a coarse mip level smears beyond its brick
uniform vec3 uColor[CHANNELS];  // linear RGB
#ifdef DISC
uniform bvec4 uInDisc;  // which channels show in the disc alone
uniform bool uAllInDisc;
uniform vec3 uApex;  // um: the disc is a cone from here ...
uniform vec3 uAxis;  // ... along this unit vector
uniform vec2 uDisc;  // cosines of its inner and outer radius
uniform float uReach;  // cosine of what is marched of it: a little more, for pixels that mix others
uniform bool uIsCrossing;  // all that is marched shows in the disc alone
#endif
uniform float uPresence;  // 0..1: volumes fade in once they have come
uniform vec3 uClipLow;  // um: nothing outside is drawn
uniform vec3 uClipHigh;
uniform vec4 uClipPlane;  // xyz unit normal, w um: nothing with dot(normal, p) > w is drawn
uniform vec4 uCorner[3];  // nothing with that for all three is drawn
uniform sampler3D uVolume;
uniform usampler3D uIndex;  // with STREAM_BRICK
uniform sampler3D uOldVolume;  // what the volume takes the place of, at another mip level
uniform float uFresh;  // 0..1: share of the new one
uniform sampler3D uOccupancy;  // bricks to the nearest visible one / 255
uniform sampler2D uLut;  // 256 x CHANNELS: RGB factor to the colour, A opacity a voxel
#ifdef TWO_D
uniform sampler2DArray uTables2d;  // 256 x 64 x CHANNELS: the same by value and steepness
#endif
uniform sampler2D uSceneDepth;
uniform sampler2D uPaneDepth;
uniform bool uHasPane;  // whether any surface is translucent
uniform vec3 uKeyLight;  // what a white surface sends on that faces the lamp ...
uniform vec3 uFillLight;  // ... the weaker one ...
uniform vec3 uSkyLight;  // ... the sky, and the ground
uniform vec3 uGroundLight;
uniform float uGloss;  // of the lamp's light, at most
uniform sampler3D uReached;  // light that comes to each cell round all volumes: around, and the lamp's
uniform mat4 uToShading;  // from the box, um, to its texture coordinates
uniform float uShadingCell;  // um
uniform float uDepthShading;  // 0..1: by how much it counts
uniform sampler2D uNoise;  // blue noise
uniform float uPhase;  // 0..1: by how much it is shifted in this frame
uniform vec4 uEye;  // the eye's part of the picture: x, y, width, height, pixels ...
uniform vec4 uPart;  // ... and of what is drawn here, which may have fewer

// At a sample that is covered: else rays at a tile's rim would miss the tile and leave a seam.
centroid in vec3 vPosition;
flat in vec3 vEye;
flat in vec3 vLight;
flat in vec3 vFill;
flat in vec3 vUp;
flat in vec2 vDepth;
centroid in float vViewZ;

layout(location = 0) out vec4 oColor;  // linear, premultiplied: up to the pane, or all
layout(location = 1) out vec4 oBehind;  // beyond the pane

#include <chunks/intersect_box>
#include <chunks/clip_span>
#ifdef DISC
#include <chunks/focus_disc>
#include <chunks/cone_span>
#include <chunks/disc_weights>
#endif
#include <chunks/scene_distance>
#include <chunks/skip_empty_bricks>
#include <chunks/sample_intensities>
#include <chunks/classify>
#ifdef TWO_D
#include <chunks/transfer_table_2d>
#include <chunks/classify_2d>
#endif
#include <chunks/gradient>
#include <chunks/cut_face>
#include <chunks/depth_shading>
#include <chunks/shade>
#include <chunks/jitter>
#include <chunks/periphery>

const float NOWHERE = 1e30;

#ifdef SUM
// Light of what is opaque all along the mean edge of all tiles that are marched. The screen shows thin and
// deep things: a tenth of it is a third as bright, and few specimens are more than half full.
const float SUM_LIGHT = 4.0;
#endif
#ifdef MAXIMUM
// The largest value of each channel in its colour, from the first that its table shows to the window's
// end, where half-way is half as bright on the screen, as on a microscope's; as opaque as it is bright.
vec4 brightest(vec4 largest) {
  vec4 low = max(uWindowLow, uFloor);
  vec4 share = clamp((largest - low) / max(uWindowHigh - low, 1e-3), 0.0, 1.0);
  share = pow(share, vec4(2.2));  // the screen's
  vec3 color = vec3(0.0);
  // channels as tiles are blended: else a border would show where two tiles hold one each
  for (int c = 0; c < CHANNELS; c++) color = max(color, share[c] * uColor[c]);
  return vec4(color, min(1.0, max(max(share.x, share.y), max(share.z, share.w))));
}
#endif

// A ray that ended early is opaque: what was left out behind looks as what is in front.
vec4 shown(vec4 sum) {
#if defined(MAXIMUM) || defined(SUM)
  return sum;
#else
  return sum.a >= OPAQUE ? sum / sum.a : sum;
#endif
}

void main() {
  if (isLeftOut(ivec2(gl_FragCoord.xy), uPart)) discard;
  vec3 ray = vPosition - vEye;
  float back = length(ray);
  vec3 dir = ray / back;
  vec3 invDir = 1.0 / (dir + 1e-6 * vec3(equal(dir, vec3(0.0))));
  vec2 span = intersectBox(vEye, invDir, vec3(0.0), uSize);
  span.x = max(span.x, 0.0);
  vec2 all = intersectBox(vEye, invDir, uAllLow, uAllHigh);
  float share = (span.y - span.x) / max(all.y - max(all.x, 0.0), 1e-6);
  share = min(1.0, share) * shareOfSteps(gl_FragCoord.xy, uPart);
  int steps = clamp(int(share * float(uSteps - uSpare) + 1e-3), 1, MAX_STEPS);
  span = clipSpan(span, vEye, dir, invDir);
#ifdef DISC
  if (uAllInDisc) span = coneSpan(span, vEye, dir);
#endif
  vec3 scene = sceneDistances(back);
  // From here on t counts from where the ray comes in: far from the eye, floats would be too coarse.
  vec3 start = vEye + span.x * dir;
  float edge = min(span.y, scene.x) - span.x;
  float end = min(span.y, scene.y) - span.x;
  if (end <= 0.0) discard;

  vec3 texPerUm = (uTexHigh - uTexLow) / uSize;
  vec3 texStart = uTexLow + start * texPerUm;
  vec3 texDir = dir * texPerUm;
  vec3 brickStart = texStart * uTexels / float(SKIP_BRICK);  // the same ray in bricks
  vec3 brickDir = texDir * uTexels / float(SKIP_BRICK);
  brickDir += 1e-9 * vec3(equal(brickDir, vec3(0.0)));
  vec3 invBrickDir = 1.0 / brickDir;
#ifdef MAXIMUM
  vec4 largest = vec4(0.0);  // intensities
#endif
  vec4 sum = vec4(0.0);
  vec4 veil = vec4(0.0);  // the sum in front of the edge
  float pane = uHasPane ? paneDistance(back) - span.x : NOWHERE;
  vec4 front = vec4(0.0);  // the sum in front of the pane
  bool isBehind = false;
  float shift = jitter(gl_FragCoord.xy - uPart.xy);
  vec3 face = span.x > 0.0 ? cutFace(start) : vec3(0.0);
#ifdef SUM
  vec3 across = uAllHigh - uAllLow;
  float light = SUM_LIGHT * uVoxel / pow(across.x * across.y * across.z, 1.0 / 3.0);
#endif
  float t = 0.0;
  float exit = 0.0;  // of the bricks that are known
  int i = 0;
#if defined(MAXIMUM) || defined(SUM)
  const float FULL = 2.0;  // no sample veils another
#else
  const float FULL = OPAQUE;
#endif
  // In legs, to the pane, the edge and the end: so no sample asks what it passes.
  bool isPast = false;  // the edge
  for (int leg = 0; leg < 3; leg++) {
    float stop = min(isPast ? end : edge, pane);
    for (; i < steps && t < stop && sum.a < FULL; i++) {
      // What remains of the ray over what remains of the budget: it always reaches the end.
      float dt = max(uMinStep, (end - t) / float(steps - i));
      // A loop of its own: rays beside each other then sample together, whatever they skipped.
      while (t >= exit) {
        vec2 block = blockAhead(brickStart, brickDir, invBrickDir, t);
        // By whole steps, so that samples lie where they would without skips.
        float skip = block.y * floor((block.x - t) / dt) * dt;
        exit = skip > 0.0 ? t + skip : block.x;
        if (skip <= 0.0) break;
        t = exit;
        if (++i >= steps || t >= end) break;
        dt = max(uMinStep, (end - t) / float(steps - i));
      }
      if (i >= steps || t >= stop) break;
      float here = min(dt, stop - t);  // the last step may be shorter
      float at = t + shift * here;
      vec3 p = texStart + at * texDir;
      vec4 v = sampleIntensities(p);
#ifdef TWO_D
      if (any(greaterThan(v, uFloor)) && mayShow(v)) {
#else
      if (any(greaterThan(v, uFloor))) {
#endif
#ifdef DISC
        vec4 voxels = here * uDensity / uVoxel * weights(start + at * dir);
#else
        vec4 voxels = vec4(here * uDensity / uVoxel * uPresence);
#endif
        vec4 shares;
#ifdef TWO_D
        vec4 steepness = steepnessOf(stepsAt(p, uVoxel * abs(texPerUm)));
        vec4 s = classify2d(v, steepness, voxels, shares);
#else
        vec4 s = classify(v, voxels, shares);
#endif
#if defined(MAXIMUM)
        largest = max(largest, mix(vec4(0.0), v, greaterThan(voxels, vec4(0.0))));
        sum = brightest(largest);
#elif defined(SUM)
        sum.rgb += light * s.a * s.rgb;
#else
        if (s.a > 0.0) {
#ifndef UNLIT  // for the benchmark, whose peers are timed without their light
          vec3 gradient = -face;
          if (t >= uVoxel || face == vec3(0.0)) {
            gradient = gradientAt(p, texPerUm, uContrast * shares);
          }
          s.rgb = shadeBy(s.rgb, gradient, dir, start + at * dir);
#endif
          sum += (1.0 - sum.a) * vec4(s.rgb * s.a, s.a);
        }
#endif
      }
      t += here;
    }
    if (i >= steps || t >= end || sum.a >= FULL) break;
    if (t >= pane) {
      front = isPast ? mix(veil, sum, scene.z) : sum;
      sum = veil = vec4(0.0);
#ifdef MAXIMUM
      largest = vec4(0.0);
#endif
      pane = NOWHERE;
      isBehind = true;
    }
    if (t >= edge && !isPast) {
      veil = sum;
      isPast = true;
    }
  }
#ifdef COUNT_STEPS  // for tests: the number of steps, and the share of the ray that they covered
  oColor = vec4(float(i % 256) / 255.0, float(i / 256) / 255.0, clamp(t / end, 0.0, 1.0), 1.0);
  return;
#endif
  if (isPast) sum = mix(veil, sum, scene.z);
  vec4 most = max(sum, front);
  if (max(max(most.r, most.g), max(most.b, most.a)) <= 0.0) discard;
  oColor = shown(isBehind ? front : sum);
  oBehind = isBehind ? shown(sum) : vec4(0.0);
}

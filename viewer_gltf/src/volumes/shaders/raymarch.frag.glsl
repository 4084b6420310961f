// Marches the volume of one tile, up to CHANNELS channels together, front to back. The part in
// front of the nearest translucent surface (the pane) and the part behind it are separate outputs,
// because the pane is drawn between them.
// The ray is in um from the box's low corner, y up, so anisotropic voxels need no special care.
// After Engel et al., Real-Time Volume Graphics (2006): opacity correction, early termination.
precision highp float;
precision highp sampler3D;
precision highp sampler2DArray;
precision highp usampler3D;

uniform vec3 uSize;  // um: edges of the tile's box
uniform vec3 uTexLow;  // texture coordinates at the box's low corner
uniform vec3 uTexHigh;  // texture coordinates at the box's high corner
uniform vec3 uTexels;  // number of texels of mip level 0 along x, y, z
uniform float uVoxel;  // um: length of path for which the opacities of the transfer functions hold
uniform float uDensity;  // factor to the optical depth of all matter
uniform float uMinStep;  // um: shortest step along a ray
uniform vec4 uFloor;  // for each channel: intensities up to this are invisible
uniform vec4 uContrast;  // for each channel: factor of the gradients used for shading
#ifdef MAXIMUM
uniform vec4 uWindowLow;  // for each channel: intensity that is shown dark, 0 to 1
uniform vec4 uWindowHigh;  // for each channel: intensity that is shown bright, 0 to 1
#endif
uniform int uSteps;  // steps of a ray through all tiles, at most MAX_STEPS
uniform int uSpare;  // steps reserved for the other tiles, one each
uniform vec3 uAllLow;  // um, the same space: low corner of the box around all marched tiles
// High corner of that box; each tile gets steps by its share of the ray's length.
uniform vec3 uAllHigh;
uniform vec3 uSkipScale;  // bricks of uOccupancy along the whole texture
uniform float uSkipShift;  // brick at the texture's low corner
uniform float uBrickSlack;  // bricks by which a coarse mip level spreads beyond its brick
uniform vec3 uColor[CHANNELS];  // linear RGB
#ifdef DISC
uniform bvec4 uInDisc;  // channels that are shown only in the disc
uniform bool uAllInDisc;
uniform vec3 uApex;  // um: apex of the disc's cone
uniform vec3 uAxis;  // the cone's axis, a unit vector
uniform vec2 uDisc;  // cosines of the disc's inner and outer radius
// Cosine of the marched radius, slightly larger for pixels that mix with others.
uniform float uReach;
uniform bool uIsCrossing;  // whether all marched channels are shown only in the disc
#endif
uniform float uPresence;  // 0 to 1: volumes fade in when they are loaded
uniform vec3 uClipLow;  // um: low corner of the clip box; nothing outside the box is drawn
uniform vec3 uClipHigh;
uniform vec4 uClipPlane;  // xyz unit normal, w um: points with dot(normal, p) > w are not drawn
uniform vec4 uCorner[3];  // three planes like uClipPlane; points beyond all three are not drawn
uniform sampler3D uVolume;
uniform usampler3D uIndex;  // only with STREAM_BRICK: slot and level of each cell's brick
uniform sampler3D uOldVolume;  // the volume that uVolume replaces, at another mip level
uniform float uFresh;  // weight of uVolume while it fades in over uOldVolume, 0 to 1
uniform sampler3D uOccupancy;  // distance to the nearest visible brick, in bricks / 255
uniform sampler2D uLut;  // 256 x CHANNELS: RGB factor of the colour, A opacity per voxel
#ifdef TWO_D
// 256 x 64 x CHANNELS: RGB factor and opacity by intensity and gradient.
uniform sampler2DArray uTables2d;
#endif
uniform sampler2D uSceneDepth;
uniform sampler2D uPaneDepth;
uniform bool uHasPane;  // whether any surface is translucent
uniform vec3 uKeyLight;  // light that a white surface reflects when it faces the key light
uniform vec3 uFillLight;  // light that a white surface reflects when it faces the fill light
uniform vec3 uSkyLight;  // light that a white surface reflects when it faces the sky
uniform vec3 uGroundLight;  // light that a white surface reflects when it faces the ground
uniform float uGloss;  // largest share of the key light in a highlight
// Light that reaches each cell around all volumes: x from all around, y from the lamp.
uniform sampler3D uReached;
uniform mat4 uToShading;  // from the box, um, to its texture coordinates
uniform float uShadingCell;  // um: edge of a cell of uReached
uniform float uDepthShading;  // strength of the shading, 0 to 1
uniform sampler2D uNoise;  // a tile of blue noise, which shifts the samples of each ray
uniform float uPhase;  // shift of the noise in this frame, 0 to 1
uniform vec4 uEye;  // the eye's part of the frame: x, y, width, height, pixels
uniform vec4 uPart;  // the eye's part of the image that is drawn here, which may have fewer pixels

// The position lies at a covered sample of the pixel. Otherwise rays at a tile's edge would miss the
// tile and leave a seam.
centroid in vec3 vPosition;
flat in vec3 vEye;
flat in vec3 vLight;
flat in vec3 vFill;
flat in vec3 vUp;
flat in vec2 vDepth;
centroid in float vViewZ;

layout(location = 0) out vec4 oColor;  // linear, premultiplied: up to the pane, or everything
layout(location = 1) out vec4 oBehind;  // behind the pane

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

// Share of a pixel, 0 to 1, below which a sample is lit as matter without a boundary. Its gradient
// would take eight samples more. For one sample it changes less than half a step of 8 bits; for many
// samples of a ray it changed a picture of nuclei by 0.02 dB (docs/decisions/ray-march.md).
const float FAINT = 0.002;

#ifdef SUM
// Light that a ray collects in opaque matter as long as the mean edge of the box around all tiles; 1
// is white. The value is above 1, because few specimens are more than half full. Thin structures
// stay visible beside thick ones: on a screen, a tenth of the light looks a third as bright.
const float SUM_LIGHT = 4.0;
#endif
#ifdef MAXIMUM
// The largest value of each channel in the channel's colour, from the first visible intensity to
// the end of the window. Half-way is half as bright on the screen, as in a microscope's image. The
// opacity equals the brightness.
vec4 brightest(vec4 largest) {
  vec4 low = max(uWindowLow, uFloor);
  vec4 share = clamp((largest - low) / max(uWindowHigh - low, 1e-3), 0.0, 1.0);
  share = pow(share, vec4(2.2));  // the gamma of the screen
  vec3 color = vec3(0.0);
  // The maximum, like the blending of tiles; otherwise a border would show between two tiles with
  // one channel each.
  for (int c = 0; c < CHANNELS; c++) color = max(color, share[c] * uColor[c]);
  return vec4(color, min(1.0, max(max(share.x, share.y), max(share.z, share.w))));
}
#endif

// Whether any channel shows something of this intensity.
bool isVisible(vec4 intensity) {
#if CHANNELS == 1
  return intensity.x > uFloor.x;
#else
  return any(greaterThan(intensity, uFloor));
#endif
}

// A ray that ended early is made opaque: the skipped part behind counts as equal to the part in
// front.
vec4 shown(vec4 sum) {
#if defined(MAXIMUM) || defined(SUM)
  return sum;
#else
  return sum.a >= OPAQUE ? sum / sum.a : sum;
#endif
}

void main() {
  // Nothing is added where a ray ends here. Some drivers run the rest of a shader after `discard`.
  oColor = oBehind = vec4(0.0);
  if (isLeftOut(ivec2(gl_FragCoord.xy), uPart)) return;
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
  // From here on, t is 0 where the ray enters: from a far eye, floats would be too coarse.
  vec3 start = vEye + span.x * dir;
  float edge = min(span.y, scene.x) - span.x;
  float end = min(span.y, scene.y) - span.x;
  if (end <= 0.0) return;

  vec3 texPerUm = (uTexHigh - uTexLow) / uSize;
  vec3 texStart = uTexLow + start * texPerUm;
  vec3 texDir = dir * texPerUm;
  BrickRay bricks = brickRay(texStart * uSkipScale + uSkipShift, texDir * uSkipScale);
#ifdef MAXIMUM
  vec4 largest = vec4(0.0);  // largest intensity of each channel along the ray
#endif
  vec4 sum = vec4(0.0);
  // The sum up to `edge`, where opaque surfaces at the pixel's centre end the ray.
  vec4 veil = vec4(0.0);
  float pane = uHasPane ? paneDistance(back) - span.x : NOWHERE;
  vec4 front = vec4(0.0);  // the sum in front of the pane
  bool isBehind = false;
  float shift = jitter(gl_FragCoord.xy - uPart.xy);
#ifndef UNLIT
  RayLight rayLight = lightAlong(dir);
#endif
  vec3 face = span.x > 0.0 ? cutFace(start) : vec3(0.0);
#ifdef SUM
  vec3 across = uAllHigh - uAllLow;
  float light = SUM_LIGHT * uVoxel / pow(across.x * across.y * across.z, 1.0 / 3.0);
#endif
  float density = uDensity / uVoxel;  // per um
#ifndef DISC
  density *= uPresence;
#endif
  float t = 0.0;
  float exit = 0.0;  // t up to which the bricks were looked up
  float slack = 1e-3 * uMinStep;  // a shorter rest of the ray is no more than rounding
  float left = float(steps);  // steps that are left; they divide the rest of the ray to its end
  float dt = max(uMinStep, end / left);
#if defined(MAXIMUM) || defined(SUM)
  const float FULL = 2.0;  // no sample hides another
#else
  const float FULL = OPAQUE;
#endif
  // The loop runs in three legs, which end at the pane, at `edge` and at `end`. Samples therefore
  // need not test what they have passed.
  bool isPast = false;  // whether the ray has passed `edge`
  for (int leg = 0; leg < 3; leg++) {
    float stop = min(isPast ? end : edge, pane);
    float brink = stop - slack;
    while (t < brink) {
      float here = min(stop - t, dt);  // the last step may be shorter
      float at = t + shift * here;
      // Skipping has a separate loop, so that neighbouring rays sample together, however much they
      // skipped.
      while (at >= exit) {
        vec2 block = blockAhead(bricks, at);
        // The ray skips whole steps whose samples lie in the block. Where steps can still become
        // shorter, it skips only steps that end in the block. A long step over its end would leave
        // out matter, and the shorter steps behind it would not make up for that.
        bool isShortest = dt <= uMinStep;
        float ahead = isShortest ? ceil((block.x - at) / dt) : floor((block.x - t) / dt);
        float skip = block.y * min(ahead, floor((stop - t) / dt)) * dt;
        t += skip;
        left -= step(dt, skip);
        dt = max(uMinStep, (end - t) / max(left, 1.0));
        here = clamp(stop - t, 0.0, dt);
        at = t + shift * here;
        exit = skip > 0.0 && t < brink ? at : max(block.x, at + slack);
      }
      vec3 p = texStart + at * texDir;
      vec4 v = sampleIntensities(p);
#ifdef TWO_D
      if (isVisible(v) && mayShow(v)) {
#else
      if (isVisible(v)) {
#endif
#ifdef DISC
        vec4 voxels = here * density * weights(start + at * dir);
#else
        vec4 voxels = vec4(here * density);
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
#ifndef UNLIT  // for the benchmark, which times other programs without lighting
          bool isCut = t < 0.5 * uVoxel && face != vec3(0.0);  // the first step
          vec3 gradient = isCut ? -face : vec3(0.0);
          if (!isCut && (1.0 - sum.a) * s.a >= FAINT) {
            gradient = gradientAt(p, texPerUm, uContrast * shares);
          }
          s.rgb = shadeBy(s.rgb, gradient, rayLight, start + at * dir);
#endif
          sum += (1.0 - sum.a) * vec4(s.rgb * s.a, s.a);
        }
#endif
      }
      t += here;
      left -= step(slack, here);
      brink = sum.a < FULL ? brink : 0.0;
    }
    if (sum.a >= FULL) break;
    t = max(t, stop);
    if (t >= end) break;
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
  int count = steps - int(left);
  oColor = vec4(float(count % 256) / 255.0, float(count / 256) / 255.0, clamp(t / end, 0.0, 1.0), 1.0);
  return;
#endif
  if (isPast) sum = mix(veil, sum, scene.z);
  oColor = shown(isBehind ? front : sum);
  oBehind = isBehind ? shown(sum) : vec4(0.0);
}

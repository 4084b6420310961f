// Free flight through the medium. The extinction in a brick never exceeds the brick's majorant, so
// tracking brick by brick is unbiased for bricks of any size (Woodcock et al. 1965). Local
// majorants are from Szirmay-Kalos et al., Computer Graphics Forum 2010. The arguments `from` and
// `to` are lengths along the ray, um. The direction `dir` is a unit vector without zero components.
// Bricks are traversed as by Amanatides & Woo 1987.
// The limit is more than any path needs; it keeps a fault from hanging the page.
const int MAX_EVENTS = 8192;

struct Bricks {
  vec3 pace;  // bricks per um along each axis of the box
  ivec3 cell;
  ivec3 way;
  vec3 wall;  // lengths along the ray to the next brick boundary of each axis
  vec3 gap;  // lengths between two boundaries of each axis
};

Bricks enterBricks(vec3 origin, vec3 dir, float from) {
  Bricks b;
  b.pace = uTexPerUm * uTexels / uBrick;
  vec3 start = uTexLow * uTexels / uBrick + origin * b.pace;
  vec3 slope = dir * b.pace;
  ivec3 last = textureSize(uMajorants, 0) - 1;
  b.cell = clamp(ivec3(floor(start + from * slope)), ivec3(0), last);
  b.way = ivec3(sign(slope));
  b.gap = abs(1.0 / slope);
  b.wall = (vec3(b.cell) + max(vec3(b.way), 0.0) - start) / slope;
  return b;
}

void leaveBrick(inout Bricks b) {
  if (b.wall.x <= b.wall.y && b.wall.x <= b.wall.z) {
    b.cell.x += b.way.x;
    b.wall.x += b.gap.x;
  } else if (b.wall.y <= b.wall.z) {
    b.cell.y += b.way.y;
    b.wall.y += b.gap.y;
  } else {
    b.cell.z += b.way.z;
    b.wall.z += b.gap.z;
  }
}

float brickEnd(Bricks b, float to) {
  return min(min(b.wall.x, b.wall.y), min(b.wall.z, to));
}

float majorantOf(Bricks b) {
  ivec3 last = textureSize(uMajorants, 0) - 1;
  return texelFetch(uMajorants, clamp(b.cell, ivec3(0), last), 0).r;
}

// If the user sets a number of steps (uStride), the medium is sampled once at a random place of
// each step instead. Few steps are fast but may miss thin structures; many give the same result.
float trackBySteps(vec3 origin, vec3 dir, float from, float to, out vec4 medium) {
  medium = vec4(0.0);
  for (float t = from; t < to; t += uStride) {
    float stride = min(uStride, to - t);
    float at = t + random() * stride;
    medium = mediumAt(origin + at * dir);
    if (random() >= exp(-medium.a * stride)) return at;
  }
  return -1.0;
}

float transmittanceBySteps(vec3 origin, vec3 dir, float from, float to) {
  float depth = 0.0;
  for (float t = from; t < to; t += uStride) {
    float stride = min(uStride, to - t);
    depth += stride * mediumAt(origin + (t + random() * stride) * dir).a;
  }
  return exp(-depth);
}

// Where the path hits the medium, and the medium there; -1 if the path leaves it.
float track(vec3 origin, vec3 dir, float from, float to, out vec4 medium) {
  if (uStride > 0.0) return trackBySteps(origin, dir, from, to, medium);
  Bricks b = enterBricks(origin, dir, from);
  float t = from;
  float depth = -log(1.0 - random());  // optical depth of the majorants to the next event
  for (int i = 0; i < MAX_EVENTS; i++) {
    float end = brickEnd(b, to);
    float majorant = majorantOf(b);
    float inBrick = majorant * max(end - t, 0.0);
    if (inBrick <= depth) {
      depth -= inBrick;
      if (end >= to) return -1.0;
      t = max(t, end);
      leaveBrick(b);
      continue;
    }
    t += depth / majorant;
    medium = mediumAt(origin + t * dir);
    if (random() * majorant < medium.a) return t;
    depth = -log(1.0 - random());
  }
  return -1.0;
}

// Share of light that is transmitted, by ratio tracking (Novak et al. 2014); its mean is exact.
float transmittance(vec3 origin, vec3 dir, float from, float to) {
  if (uStride > 0.0) return transmittanceBySteps(origin, dir, from, to);
  Bricks b = enterBricks(origin, dir, from);
  float t = from;
  float share = 1.0;
  float depth = -log(1.0 - random());
  for (int i = 0; i < MAX_EVENTS; i++) {
    float end = brickEnd(b, to);
    float majorant = majorantOf(b);
    float inBrick = majorant * max(end - t, 0.0);
    if (inBrick <= depth) {
      depth -= inBrick;
      if (end >= to) return share;
      t = max(t, end);
      leaveBrick(b);
      continue;
    }
    t += depth / majorant;
    share *= 1.0 - mediumAt(origin + t * dir).a / majorant;
    if (share < 0.1) {  // Russian roulette
      if (random() >= 0.5) return 0.0;
      share *= 2.0;
    }
    depth = -log(1.0 - random());
  }
  return share;
}

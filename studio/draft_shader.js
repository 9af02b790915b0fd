// The shader of draft.js: a ray for each pixel through the grid of light and dust that the server
// made (src/studio/draft.h), with emission and absorption.

export const march = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler3D;
uniform sampler3D voxels;
uniform sampler3D variants;  // of the dust
uniform bool has_variants;
uniform vec3 nodes;      // of each axis
uniform vec3 core;
uniform vec3 share;
uniform mat3 to_ball;
uniform float radius;    // scene units
uniform vec3 eye;        // from the galaxy's centre, scene units
uniform vec3 right;      // across half of the image
uniform vec3 up;
uniform vec3 back;
uniform bool perspective;
uniform float side;      // of a pixel: its share of 'right'
uniform mat3 light;      // planes to channels
uniform vec3 extinction; // of each plane, per galaxy radius of a voxel's number 1
uniform float stride;    // nodes between two points of a ray
in vec2 place;
out vec4 sum;

const int most_steps = 4096;
const int parts = 12;    // of a pixel's side, at the galaxy's centre

vec3 stretched(vec3 x) { return sign(x) * log(abs(x) + sqrt(x * x + 1.0)); }

vec3 cell(vec3 at) {
  vec3 index = 0.5 * (nodes - 1.0) * (1.0 + (1.0 - share) * at + share * stretched(at / core) / stretched(1.0 / core));
  return (index + 0.5) / nodes;
}

// Nodes per galaxy radius at a place.
vec3 density(vec3 at) {
  return 0.5 * (nodes - 1.0) * (1.0 - share + share / (stretched(1.0 / core) * sqrt(at * at + core * core)));
}

// The share of the light of a step that is seen, with dust of this depth mixed in, behind dust of
// transmission 'clear': (1 - exp(-x))/x. The dust of the step is then in front.
vec3 through(vec3 depth, inout vec3 clear) {
  vec3 passed = exp(-depth);
  vec3 mixed = mix(1.0 - 0.5 * depth, (1.0 - passed) / max(depth, 1e-3), greaterThan(depth, vec3(1e-3)));
  vec3 seen = clear * mixed;
  clear *= passed;
  return seen;
}

// The planes along the ray of a place in the image, from -1 to 1.
vec3 ray(vec2 at) {
  vec3 offset = at.x * right + at.y * up;
  vec3 from = to_ball * (perspective ? eye : eye + offset);
  vec3 way = to_ball * (perspective ? normalize(offset - back) : -back);
  float nearest = -dot(from, way) / dot(way, way);
  vec3 middle = from + nearest * way;
  float room = 1.0 - dot(middle, middle);
  if (room <= 0.0) return vec3(0.0);
  float end = sqrt(room / dot(way, way));
  float t = perspective ? max(-end, -nearest) : -end;
  vec3 light_sum = vec3(0.0), speed = abs(way);
  vec3 clear[3] = vec3[3](vec3(1.0), vec3(1.0), vec3(1.0));
  for (int i = 0; i < most_steps && t < end; ++i) {
    vec3 rate = density(middle + t * way) * speed;
    float step = stride / max(rate.x, max(rate.y, rate.z));
    rate = density(middle + (t + 0.5 * step) * way) * speed;
    step = min(stride / max(rate.x, max(rate.y, rate.z)), end - t);
    vec3 at = cell(middle + (t + 0.5 * step) * way);
    vec4 voxel = texture(voxels, at);
    vec3 weight = through(voxel.a * extinction * step, clear[0]);
    if (has_variants) {
      vec2 other = texture(variants, at).rg;
      weight = 2.0 / 3.0 * weight + (through(other.r * extinction * step, clear[1]) +
                                     through(other.g * extinction * step, clear[2])) / 6.0;
    }
    light_sum += weight * voxel.rgb * step;
    t += step;
  }
  return light_sum;
}

// Distance of a ray from the galaxy's centre, in pixels.
float distance_in_pixels(vec2 at) {
  vec3 offset = at.x * right + at.y * up;
  vec3 from = perspective ? eye : eye + offset;
  vec3 way = perspective ? normalize(offset - back) : -back;
  float along = -dot(from, way);
  float pixel = side * length(right) * (perspective ? max(along, 0.0) : 1.0);
  return length(from + along * way) / max(pixel, 1e-30);
}

void main() {
  vec2 at = 2.0 * place - 1.0;
  vec2 pixel = vec2(side, side * length(right) / length(up));
  vec3 planes = vec3(0.0);
  if (distance_in_pixels(at) < 1.5) {
    // The mean over a pixel differs from its middle at a cusp.
    for (int i = 0; i < parts * parts; ++i) {
      vec2 part = (vec2(i % parts, i / parts) + 0.5) / float(parts) - 0.5;
      planes += ray(at + part * pixel) / float(parts * parts);
    }
  } else {
    planes = ray(at);
  }
  sum = vec4(light * planes, 1.0);
}`;

// The shaders of picture.js. sum() adds planes to three channels, stretch() makes colours of them;
// its formulas are those of stretch.js. Both make a text for each use, since without a GPU branches
// and loops cost several times the arithmetic.

export const square = `#version 300 es
in vec2 corner;
out vec2 place;
void main() {
  place = 0.5 * (corner + 1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

/// `texels` texels of four planes each, with weights of the planes in three channels.
export const sum = (texels) => `#version 300 es
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray planes;
uniform mat4x3 weights[${texels}];
in vec2 place;
out vec4 light;
void main() {
  vec3 channels = vec3(0.0);
  ${Array.from({length: texels}, (_, i) => `channels += weights[${i}] * texture(planes, vec3(place, ${i}));`).join('\n  ')}
  light = vec4(channels, 1.0);
}`;

// One direction of a convolution, and noise: a normal deviate of each pixel and channel (PCG hash,
// Jarzynski & Olano 2020, and Box & Muller 1958).
export const seeing = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
uniform sampler2D channels;
uniform ivec2 way;
uniform float kernel[KERNEL_LENGTH];
uniform int reach;
uniform float noise;
in vec2 place;
out vec4 light;

uvec3 pcg(uvec3 v) {
  v = v * 1664525u + 1013904223u;
  v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
  v ^= v >> 16u;
  v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
  return v;
}

vec3 normal(ivec2 at) {
  vec3 a = (vec3(pcg(uvec3(at, 1))) + 0.5) / 4294967296.0;
  vec3 b = vec3(pcg(uvec3(at, 2))) / 4294967296.0;
  return sqrt(-2.0 * log(a)) * cos(6.283185307179586 * b);
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy), size = textureSize(channels, 0);
  vec3 sum = vec3(0.0);
  for (int i = -reach; i <= reach; ++i) {
    ivec2 from = at + way * i;
    if (any(lessThan(from, ivec2(0))) || any(greaterThanEqual(from, size))) continue;
    sum += kernel[abs(i)] * texelFetch(channels, from, 0).rgb;
  }
  if (noise > 0.0) sum += noise * normal(at);
  light = vec4(sum, 1.0);
}`;

/// The stretch of a mode (stretch.js). With `smoothed`, light between pixels is interpolated. With
/// `shoulder`, levels near 1 rise more slowly, as a look's contrast requires. Without `gamma` or
/// `saturation`, that value is 1. With `groups` the light is the sum of two textures, each times
/// its factor.
export const stretch = ({mode, smoothed, shoulder, gamma, saturation, groups}) => `#version 300 es
precision highp float;
precision highp sampler2D;
#define LUPTON ${mode === 'lupton' ? 1 : 0}
#define LOG ${mode === 'log' ? 1 : 0}
#define LINEAR ${mode === 'linear' ? 1 : 0}
#define SMOOTHED ${smoothed ? 1 : 0}
#define SHOULDER ${shoulder ? 1 : 0}
#define GAMMA ${gamma ? 1 : 0}
#define SATURATION ${saturation ? 1 : 0}
#define GROUPS ${groups ? 1 : 0}
uniform sampler2D channels;
#if GROUPS
uniform sampler2D others;
uniform vec2 factors;
#endif
uniform vec3 black;
uniform vec3 factor;
uniform float slope;
uniform float white;
uniform float steepness; // log(1 + slope white) or asinh(slope white); 0 for a straight line
uniform float handle;    // the black handle
uniform float gain;
uniform float gamma;
uniform float saturation;
in vec2 place;
out vec4 colour;

float inverse_sinh(float x) {
  // log1p by series where the logarithm would lose digits.
  return x < 1e-2 ? x - x * x * x / 6.0 : log(x + sqrt(x * x + 1.0));
}

float level(float value) {
  if (!(white > 0.0)) return 0.0;
#if !LINEAR
  if (steepness > 0.0) return (LOG == 1 ? log(1.0 + slope * value) : inverse_sinh(slope * value)) / steepness;
#endif
  return value / white;
}

vec3 texel(ivec2 at) {
#if GROUPS
  return factors.x * texelFetch(channels, at, 0).rgb + factors.y * texelFetch(others, at, 0).rgb;
#else
  return texelFetch(channels, at, 0).rgb;
#endif
}

vec3 light_at(vec2 at) {
#if SMOOTHED
  ivec2 size = textureSize(channels, 0);
  vec2 from = at * vec2(size) - 0.5;
  ivec2 low = ivec2(floor(from));
  vec2 part = from - vec2(low);
  ivec2 most = size - 1;
  ivec2 a = clamp(low, ivec2(0), most), b = clamp(low + 1, ivec2(0), most);
  vec3 bottom = mix(texel(a), texel(ivec2(b.x, a.y)), part.x);
  vec3 top = mix(texel(ivec2(a.x, b.y)), texel(b), part.x);
  return mix(bottom, top, part.y);
#elif GROUPS
  return factors.x * texture(channels, at).rgb + factors.y * texture(others, at).rgb;
#else
  return texture(channels, at).rgb;
#endif
}

void main() {
  vec3 light = max(max(light_at(place) - black, 0.0) * factor * gain - handle, 0.0);
#if SATURATION
  float mean = (light.r + light.g + light.b) / 3.0;
  light = max(mean + saturation * (light - mean), 0.0);
#endif
#if LUPTON
  float intensity = (light.r + light.g + light.b) / 3.0;
  vec3 shown = intensity > 0.0 ? light * (level(intensity) / intensity) : vec3(0.0);
#if SHOULDER
  shown = mix(shown, 1.0 - 0.3 * exp((0.7 - shown) / 0.3), vec3(greaterThan(shown, vec3(0.7))));
#else
  shown /= max(max(shown.r, max(shown.g, shown.b)), 1.0);
#endif
#else
  vec3 shown = min(vec3(level(light.r), level(light.g), level(light.b)), 1.0);
#endif
#if GAMMA
  shown = pow(shown, vec3(1.0 / gamma));
#endif
  colour = vec4(shown, 1.0);
}`;

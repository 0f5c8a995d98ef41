// Colours, normals and depths of a ground. The light comes from a direction and from the sky.

uniform vec3 colour;       // reflected share of light, linear
uniform vec3 towardsLight; // unit vector

in vec3 normal;
in float depth;
in float absent;

layout(location = 0) out vec4 painted;
layout(location = 1) out vec4 surface;  // normal and depth

vec3 displayOf(vec3 linear) {
  vec3 power = 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055;
  return mix(power, 12.92 * linear, lessThan(linear, vec3(0.0031308)));
}

void main() {
  if (absent > 0.0) discard;
  vec3 n = normalize(normal);
  float light = 0.75 * max(dot(n, towardsLight), 0.0) + 0.25 * (0.5 + 0.5 * n.z);
  painted = vec4(displayOf(clamp(colour * light, 0.0, 1.0)), 1);
  surface = vec4(n, depth);
}

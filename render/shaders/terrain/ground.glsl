// Vertices of terrain patches, from a table of heights. A vertex is a sample: its number is
// slot × side² + row × side + column, where `slot` is the place of the patch in the table.
//
// Positions are relative to the eye. Columns and rows count samples from one near the eye, so a
// sample has the same bits in all patches that contain it, and far grounds lose no digits.

uniform int side;        // samples along a side of a patch
uniform vec2 spacing;    // distances of samples along x and y
uniform vec2 offset;     // position of sample (0, 0), relative to the eye
uniform vec2 eyeHeight;  // height of the eye, as the sum of two numbers
uniform vec3 clipX;      // x and y in clip space are products with these
uniform vec3 clipY;
uniform vec3 axis;       // view axis
uniform float shift;     // x in clip space gains shift × depth
uniform vec2 clipZ;      // z in clip space is clipZ.x + clipZ.y × depth, likewise for w
uniform vec2 clipW;
uniform vec2 depths;     // visible range along the view axis

layout(binding = 0) uniform samplerBuffer heights;
// For each slot: first column and row, stride, cells along x; last column and row, cells along y,
// bits of the height that stands for missing ones.
layout(binding = 1) uniform isamplerBuffer places;

out vec3 normal;
out float depth;
out float absent;  // above 0 in triangles with a missing corner

invariant gl_Position;

struct Axis {
  int first, last, stride, cells;
};

// Sample n along an axis. The last cell may be cut.
int placeOf(Axis a, int n) { return n >= a.cells ? a.last : a.first + n * a.stride; }

// Slope along an axis at sample n with the number `index` in the table. At the border of the patch
// it is that of the parabola through three samples.
float slopeOf(Axis a, int n, int index, int jump, float width) {
  float here = texelFetch(heights, index).x;
  float before = n > 0 ? texelFetch(heights, index - jump).x : here;
  float after = n < a.cells ? texelFetch(heights, index + jump).x : here;
  int low = n > 0 && !isnan(before) ? n - 1 : n;
  int high = n < a.cells && !isnan(after) ? n + 1 : n;
  float rise = (high > n ? after : here) - (low < n ? before : here);
  float slope = low < high ? rise / (float(placeOf(a, high) - placeOf(a, low)) * width) : 0.0;
  if (a.cells < 2 || (n > 0 && n < a.cells) || low == high) return slope;
  int inward = n == 0 ? 1 : -1;
  float next = texelFetch(heights, index + inward * jump).x;
  float second = texelFetch(heights, index + 2 * inward * jump).x;
  if (isnan(second) || placeOf(a, a.cells) - placeOf(a, a.cells - 1) != a.stride) return slope;
  return float(inward) * (4.0 * next - 3.0 * here - second) / (2.0 * float(a.stride) * width);
}

void main() {
  int slot = gl_VertexID / (side * side);
  int number = gl_VertexID - slot * side * side;
  ivec4 from = texelFetch(places, 2 * slot);
  ivec4 to = texelFetch(places, 2 * slot + 1);
  Axis x = Axis(from.x, to.x, from.z, from.w);
  Axis y = Axis(from.y, to.y, from.z, to.z);
  int column = min(number % side, x.cells);
  int row = min(number / side, y.cells);
  int index = slot * side * side + row * side + column;
  float height = texelFetch(heights, index).x;
  absent = isnan(height) ? 1.0 : 0.0;
  normal = vec3(0, 0, 1);
  if (absent > 0.0)
    height = intBitsToFloat(to.w);
  else
    normal = normalize(vec3(-slopeOf(x, column, index, 1, spacing.x),
                            -slopeOf(y, row, index, side, spacing.y), 1));
  precise vec3 p = vec3(float(placeOf(x, column)) * spacing.x + offset.x,
                        float(placeOf(y, row)) * spacing.y + offset.y,
                        (height - eyeHeight.x) - eyeHeight.y);
  precise float along = dot(axis, p);
  depth = along;
  gl_Position = vec4(dot(clipX, p) + shift * along, dot(clipY, p),
                     clipZ.x + clipZ.y * along, clipW.x + clipW.y * along);
  gl_ClipDistance[0] = along - depths.x;
  gl_ClipDistance[1] = depths.y - along;
}

// Cells of a grid along a ray, in double precision. The code is valid GLSL and C++, which includes it
// into classes. It uses sums, products, quotients and comparisons alone, which IEEE 754 defines to
// the last bit. Coordinates are those of the grid: points have integer coordinates.

double lesser(double a, double b) { return b < a ? b : a; }
double greater(double a, double b) { return a < b ? b : a; }
double held(double a, double low, double high) { return a < low ? low : (high < a ? high : a); }
double magnitude(double a) { return a < 0.0 ? 0.0 - a : a; }

double along(double a, double b, double share) {
  VAR sum = a + (b - a) * share;
  return sum;
}

// Values at the corners of a cell. Corner (x, y, z), each 0 or 1, has the number 4x + 2y + z.
struct CellCorners {
  double f0, f1, f2, f3, f4, f5, f6, f7;
};

// Trilinear interpolation with different points for the three axes: a blossom.
double blossomAt(IN(CellCorners) f, double x, double y, double z) {
  return along(along(along(f.f0, f.f4, x), along(f.f2, f.f6, x), y),
               along(along(f.f1, f.f5, x), along(f.f3, f.f7, x), y), z);
}

double third(double a, double b, double c) {
  VAR mean = (a + b + c) / 3.0;
  return mean;
}

double cubicAt(double b0, double b1, double b2, double b3, double t) {
  VAR s = 1.0 - t;
  VAR value = s * s * (s * b0 + 3.0 * t * b1) + t * t * (3.0 * s * b2 + t * b3);
  return value;
}

double inCell(double from, double step, double t, int cell) {
  VAR place = from + step * t - double(cell);
  return held(place, 0.0, 1.0);
}

// Distance at which a ray crosses a plane of grid points.
double distanceOf(int plane, double from, double perStep) {
  VAR at = (double(plane) - from) * perStep;
  return at;
}

// Distance at which a ray leaves a box of cells across the planes of one axis.
double leaves(int low, int size, double from, double step, double perStep, double end) {
  return step == 0.0 ? end : distanceOf(step > 0.0 ? low + size : low, from, perStep);
}

// True when a ray that steps from cell to cell has crossed a plane before it leaves a box at the
// distance t across the planes of the axis `across`. Of planes at one distance it crosses those of
// the lower axis first.
bool isCrossed(int plane, int axis, int across, double from, double perStep, double t) {
  double at = distanceOf(plane, from, perStep);
  return at < t || (at == t && axis < across);
}

// Index of the cell on one axis, behind a box of cells [low, low + size) that a ray leaves at the
// distance t. It is that of a ray that steps from cell to cell, so that skipped blocks do not change
// the result.
int nextCell(int cell, int low, int size, int axis, int across, double from, double step,
             double perStep, double t) {
  bool isUp = step > 0.0;
  if (axis == across) return isUp ? low + size : low - 1;
  if (size == 1 || step == 0.0) return cell;
  int first = isUp ? cell : low;
  int last = isUp ? low + size - 1 : cell;
  VAR place = from + step * t;
  int n = int(held(floor(place), double(first), double(last)));
  // Rounding of the position may have passed one plane too many or too few.
  bool isAbove = isCrossed(n + 1, axis, across, from, perStep, t) == isUp;
  bool isBelow = isCrossed(n, axis, across, from, perStep, t) != isUp;
  if (isAbove && n < last) return n + 1;
  if (isBelow && n > first) return n - 1;
  return n;
}

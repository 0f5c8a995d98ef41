// Search for crossings of a ray with the zero set of a function of several fields. It has the steps
// of FieldSearch in render/kernel/field_traversal.cpp, in the same order and in double precision,
// so that both have the same bits. GLSL only, not C++.
//
// The driver of the shader defines kGrids and kValues, the numbers of fields and of values of the
// FieldExpression, and kDrawn, the number of the drawn value. EACH_GRID(DO) stands for DO(g) for
// each field g. EACH_STEP(DO) stands for DO(to, how, a, b) for each step of the expression. So all
// indices of arrays are literals, and arrays stay in registers.

#define REAL precise double

const int kMostHalvings = 44;
// Mesa's llvmpipe ends loops without notice after 65535 iterations of all loops of up to 16 rays. A
// ray that needs this many is marked as lost, and the processor searches it.
const int kMostSteps = 2000;
// 2⁻⁵⁰ as a quotient of exact numbers: not all drivers round long decimal literals correctly.
const double kLeastWidth = 1.0lf / 1125899906842624.0lf;
const int kGridNumbers = 16;  // numbers of each field in `numbers`
const int kFirstGridNumber = 4;
const int kPointsOfBlock = 729;

struct Range {
  double low, high;
};

// Bounds on the value along a segment, and on a third of its derivative by the segment's parameter.
struct Bounds {
  double low, high, slopeLow, slopeHigh;
};

// Bernstein coefficients.
struct Cubic {
  double c0, c1, c2, c3;
};

// Traversal of one grid by the ray. The members are those of GridTraversal.
struct Walk {
  double ox, oy, oz, dx, dy, dz, ix, iy, iz;
  int bx, by, bz, cx, cy, cz;
  int number, blockAxis, cellAxis;
  double blockExit, cellExit;
  float low, high;                        // range of the values in the present block or cell
  float v0, v1, v2, v3, v4, v5, v6, v7;  // values at the corners of the cell
};

Walk walk[kGrids];
Cubic root[kGrids], part[kGrids];  // cubics on the segment in the cell, and on a part of it
double end;                        // length of the ray
bool searching = true;
int steps = 0;
int side = -1;  // 1: inside, 0: outside, −1: not known yet
double place;   // first crossing
double inside = 0.0lf, from = 0.0lf;  // length inside the solid up to the last crossing, `from`

double never() { return numbers[0]; }  // infinity
double lesser(double a, double b) { return b < a ? b : a; }
double greater(double a, double b) { return a < b ? b : a; }
double held(double a, double low, double high) { return a < low ? low : (high < a ? high : a); }

double smoothMin(double a, double b) {
  double softness = numbers[1];
  REAL apart = a - b;
  REAL overlap = softness - abs(apart);
  overlap = greater(overlap, 0.0lf);
  REAL taken = overlap * overlap / (4.0lf * softness);
  REAL result = lesser(a, b) - taken;
  return result;
}

double joinValue(int how, double a, double b) {
  if (how == kMorph) {
    double share = numbers[2];
    REAL mixed = (1.0lf - share) * a + share * b;
    return mixed;
  }
  double least = smoothMin(how == kUnion ? a : -a, how == kIntersection ? -b : b);
  return how == kUnion ? least : -least;
}

Range joinRange(int how, Range a, Range b) {
  bool isTurned = how == kDifference;
  return Range(joinValue(how, a.low, isTurned ? b.high : b.low),
               joinValue(how, a.high, isTurned ? b.low : b.high));
}

double mix2(double share, double a, double b) {
  REAL mixed = share * a + (1.0lf - share) * b;
  return mixed;
}

double shareAt(double ahead) {
  REAL share = 0.5lf + 0.5lf * ahead / numbers[1];
  return held(share, 0.0lf, 1.0lf);
}

Bounds joinBound(int how, Bounds a, Bounds b) {
  Range value = joinRange(how, Range(a.low, a.high), Range(b.low, b.high));
  REAL shareLow;
  REAL shareHigh;
  double slopeLow = b.slopeLow;
  double slopeHigh = b.slopeHigh;
  if (how == kMorph) {
    shareLow = 1.0lf - numbers[2];
    shareHigh = shareLow;
  } else {
    bool isTurned = how == kDifference;
    slopeLow = isTurned ? -b.slopeHigh : b.slopeLow;
    slopeHigh = isTurned ? -b.slopeLow : b.slopeHigh;
    REAL aheadLow = (isTurned ? -b.high : b.low) - a.high;
    REAL aheadHigh = (isTurned ? -b.low : b.high) - a.low;
    shareLow = shareAt(how == kUnion ? aheadLow : -aheadHigh);
    shareHigh = shareAt(how == kUnion ? aheadHigh : -aheadLow);
  }
  return Bounds(value.low, value.high,
                lesser(mix2(shareLow, a.slopeLow, slopeLow), mix2(shareHigh, a.slopeLow, slopeLow)),
                greater(mix2(shareLow, a.slopeHigh, slopeHigh),
                        mix2(shareHigh, a.slopeHigh, slopeHigh)));
}

// Range of the expression in the present blocks or cells.
Range joinedRange() {
  Range v[kValues];
#define READ(g) v[g] = Range(double(walk[g].low), double(walk[g].high));
#define JOIN(to, how, a, b) v[to] = joinRange(how, v[a], v[b]);
  EACH_GRID(READ)
  EACH_STEP(JOIN)
#undef READ
#undef JOIN
  return v[kDrawn];
}

Bounds boundsOf(Cubic c) {
  REAL d0 = c.c1 - c.c0;
  REAL d1 = c.c2 - c.c1;
  REAL d2 = c.c3 - c.c2;
  return Bounds(lesser(lesser(c.c0, c.c1), lesser(c.c2, c.c3)),
                greater(greater(c.c0, c.c1), greater(c.c2, c.c3)), lesser(lesser(d0, d1), d2),
                greater(greater(d0, d1), d2));
}

Bounds joinedBounds() {
  Bounds v[kValues];
#define READ(g) v[g] = boundsOf(part[g]);
#define JOIN(to, how, a, b) v[to] = joinBound(how, v[a], v[b]);
  EACH_GRID(READ)
  EACH_STEP(JOIN)
#undef READ
#undef JOIN
  return v[kDrawn];
}

double valueAt(Cubic c, double s) {
  REAL r = 1.0lf - s;
  REAL value = r * r * (r * c.c0 + 3.0lf * s * c.c1) + s * s * (3.0lf * r * c.c2 + s * c.c3);
  return value;
}

double joinedValue(double s) {
  double v[kValues];
#define READ(g) v[g] = valueAt(part[g], s);
#define JOIN(to, how, a, b) v[to] = joinValue(how, v[a], v[b]);
  EACH_GRID(READ)
  EACH_STEP(JOIN)
#undef READ
#undef JOIN
  return v[kDrawn];
}

Cubic halved(Cubic c, bool isRight) {
  REAL b01 = 0.5lf * (c.c0 + c.c1);
  REAL b12 = 0.5lf * (c.c1 + c.c2);
  REAL b23 = 0.5lf * (c.c2 + c.c3);
  REAL b012 = 0.5lf * (b01 + b12);
  REAL b123 = 0.5lf * (b12 + b23);
  REAL middle = 0.5lf * (b012 + b123);
  return Cubic(isRight ? middle : c.c0, isRight ? b123 : b01, isRight ? b23 : b012,
               isRight ? c.c3 : middle);
}

double plane(int k, double origin, double inverse) {
  REAL at = (double(k) - origin) * inverse;
  return at;
}

int placeIn(double t, double origin, double direction, int low, int high) {
  REAL at = origin + t * direction;
  return int(held(floor(at), double(low), double(high)));
}

// Finds the face through which the ray leaves the block or cell (x, y, z) with the given edge.
double exitOf(Walk w, int x, int y, int z, int edge, inout int axis) {
  double px = plane((x + (w.dx > 0.0lf ? 1 : 0)) * edge, w.ox, w.ix);
  double py = plane((y + (w.dy > 0.0lf ? 1 : 0)) * edge, w.oy, w.iy);
  double pz = plane((z + (w.dz > 0.0lf ? 1 : 0)) * edge, w.oz, w.iz);
  double least = never();
  bool byX = w.dx != 0.0lf && px < least;
  axis = byX ? 0 : axis;
  least = byX ? px : least;
  bool byY = w.dy != 0.0lf && py < least;
  axis = byY ? 1 : axis;
  least = byY ? py : least;
  bool byZ = w.dz != 0.0lf && pz < least;
  axis = byZ ? 2 : axis;
  return byZ ? pz : least;
}

int intAt(int g, int n) { return int(numbers[kFirstGridNumber + kGridNumbers * g + n]); }
double numberAt(int g, int n) { return numbers[kFirstGridNumber + kGridNumbers * g + n]; }
float backgroundOf(int g) { return float(numberAt(g, 12)); }
int sizeOf(int g, int a) { return intAt(g, 13 + a); }

// One component of a position or direction in the index space of grid g.
double indexOf(int g, int a, double x, double y, double z, bool isPosition) {
  REAL turned = x * numberAt(g, a) + y * numberAt(g, 3 + a) + z * numberAt(g, 6 + a);
  REAL moved = turned + numberAt(g, 9 + a);
  return isPosition ? moved : turned;
}

void clip(double origin, double direction, double inverse, int high, inout double enter,
          inout double leave) {
  bool isStill = direction == 0.0lf;
  bool misses = isStill && (origin < 0.0lf || origin > double(high));
  double near = plane(direction > 0.0lf ? 0 : high, origin, inverse);
  double far = plane(direction > 0.0lf ? high : 0, origin, inverse);
  enter = isStill ? enter : greater(enter, near);
  leave = misses ? -1.0lf : (isStill ? leave : lesser(leave, far));
}

Walk started(int g, double x, double y, double z, double dx, double dy, double dz) {
  Walk w;
  w.ox = indexOf(g, 0, x, y, z, true);
  w.oy = indexOf(g, 1, x, y, z, true);
  w.oz = indexOf(g, 2, x, y, z, true);
  w.dx = indexOf(g, 0, dx, dy, dz, false);
  w.dy = indexOf(g, 1, dx, dy, dz, false);
  w.dz = indexOf(g, 2, dx, dy, dz, false);
  REAL ix = 1.0lf / w.dx;
  REAL iy = 1.0lf / w.dy;
  REAL iz = 1.0lf / w.dz;
  bool movesX = abs(ix) < never();
  bool movesY = abs(iy) < never();
  bool movesZ = abs(iz) < never();
  w.ix = movesX ? ix : 0.0lf;
  w.iy = movesY ? iy : 0.0lf;
  w.iz = movesZ ? iz : 0.0lf;
  w.dx = movesX ? w.dx : 0.0lf;
  w.dy = movesY ? w.dy : 0.0lf;
  w.dz = movesZ ? w.dz : 0.0lf;
  double enter = 0.0lf;
  double leave = never();
  clip(w.ox, w.dx, w.ix, 8 * sizeOf(g, 0), enter, leave);
  clip(w.oy, w.dy, w.iy, 8 * sizeOf(g, 1), enter, leave);
  clip(w.oz, w.dz, w.iz, 8 * sizeOf(g, 2), enter, leave);
  w.bx = w.by = w.bz = w.cx = w.cy = w.cz = 0;
  w.number = -1;
  w.blockAxis = -1;
  w.cellAxis = -1;
  w.blockExit = enter < leave ? enter : never();
  w.cellExit = never();
  w.low = w.high = backgroundOf(g);
  w.v0 = w.v1 = w.v2 = w.v3 = w.v4 = w.v5 = w.v6 = w.v7 = 0.0;
  return w;
}

int blockAt(int g, int x, int y, int z) {
  int pagesY = (sizeOf(g, 1) + 7) >> 3;
  int pagesZ = (sizeOf(g, 2) + 7) >> 3;
  int entries = texelFetch(pages[g], ((x >> 3) * pagesY + (y >> 3)) * pagesZ + (z >> 3)).x;
  int slot = entries < 0 ? 0 : entries + ((x & 7) << 6 | (y & 7) << 3 | (z & 7));
  int entry = texelFetch(entriesOf[g], slot).x;
  return entries < 0 ? entries : entry;
}

void walkToBlock(int g, inout Walk w, double t) {
  while (++steps < kMostSteps && w.blockExit <= t) {
    bool isAway = w.blockAxis < 0;
    int x = w.bx + (w.blockAxis == 0 ? (w.dx > 0.0lf ? 1 : -1) : 0);
    int y = w.by + (w.blockAxis == 1 ? (w.dy > 0.0lf ? 1 : -1) : 0);
    int z = w.bz + (w.blockAxis == 2 ? (w.dz > 0.0lf ? 1 : -1) : 0);
    int sizeX = sizeOf(g, 0);
    int sizeY = sizeOf(g, 1);
    int sizeZ = sizeOf(g, 2);
    x = isAway ? placeIn(t, w.ox, w.dx, 0, 8 * sizeX - 1) >> 3 : x;
    y = isAway ? placeIn(t, w.oy, w.dy, 0, 8 * sizeY - 1) >> 3 : y;
    z = isAway ? placeIn(t, w.oz, w.dz, 0, 8 * sizeZ - 1) >> 3 : z;
    w.bx = x;
    w.by = y;
    w.bz = z;
    if ((x | y | z | (sizeX - 1 - x) | (sizeY - 1 - y) | (sizeZ - 1 - z)) < 0) {
      w.number = -1;
      w.blockAxis = -1;
      w.blockExit = never();
    } else {
      w.number = blockAt(g, x, y, z);
      w.blockExit = exitOf(w, x, y, z, 8, w.blockAxis);
    }
  }
  vec2 range = texelFetch(ranges[g], max(w.number, 0)).xy;
  float background = backgroundOf(g);
  float constant = w.number == kInside ? -background : background;
  w.low = w.number < 0 ? constant : range.x;
  w.high = w.number < 0 ? constant : range.y;
}

void walkToCell(int g, inout Walk w, double t, bool isFirst) {
  bool due = isFirst ? w.number >= 0 : w.cellExit <= t;
  w.cellExit = isFirst ? never() : w.cellExit;
  while (++steps < kMostSteps && due) {
    int x = w.cx + (w.cellAxis == 0 ? (w.dx > 0.0lf ? 1 : -1) : 0);
    int y = w.cy + (w.cellAxis == 1 ? (w.dy > 0.0lf ? 1 : -1) : 0);
    int z = w.cz + (w.cellAxis == 2 ? (w.dz > 0.0lf ? 1 : -1) : 0);
    w.cx = isFirst ? placeIn(t, w.ox, w.dx, 8 * w.bx, 8 * w.bx + 7) : x;
    w.cy = isFirst ? placeIn(t, w.oy, w.dy, 8 * w.by, 8 * w.by + 7) : y;
    w.cz = isFirst ? placeIn(t, w.oz, w.dz, 8 * w.bz, 8 * w.bz + 7) : z;
    isFirst = false;
    if (w.cx >> 3 != w.bx || w.cy >> 3 != w.by || w.cz >> 3 != w.bz) {
      w.cellExit = never();  // the ray leaves the block, too
    } else {
      int at = w.number * kPointsOfBlock + ((w.cx & 7) * 9 + (w.cy & 7)) * 9 + (w.cz & 7);
      w.v0 = texelFetch(values[g], at).x;
      w.v1 = texelFetch(values[g], at + 1).x;
      w.v2 = texelFetch(values[g], at + 9).x;
      w.v3 = texelFetch(values[g], at + 10).x;
      w.v4 = texelFetch(values[g], at + 81).x;
      w.v5 = texelFetch(values[g], at + 82).x;
      w.v6 = texelFetch(values[g], at + 90).x;
      w.v7 = texelFetch(values[g], at + 91).x;
      w.low = min(min(min(w.v0, w.v1), min(w.v2, w.v3)), min(min(w.v4, w.v5), min(w.v6, w.v7)));
      w.high = max(max(max(w.v0, w.v1), max(w.v2, w.v3)), max(max(w.v4, w.v5), max(w.v6, w.v7)));
      w.cellExit = exitOf(w, w.cx, w.cy, w.cz, 1, w.cellAxis);
    }
    due = w.cellExit <= t;
  }
}

double inCell(double t, double origin, double direction, int cell) {
  REAL at = origin + t * direction - double(cell);
  return held(at, 0.0lf, 1.0lf);
}

double along(double a, double b, double share) {
  REAL at = a + (b - a) * share;
  return at;
}

double third(double a, double b, double c) {
  REAL sum = (a + b + c) / 3.0lf;
  return sum;
}

// The cubic of the field along the ray between t0 and t1 in the present cell.
Cubic cubicOf(Walk w, double t0, double t1) {
  double x0 = inCell(t0, w.ox, w.dx, w.cx);
  double y0 = inCell(t0, w.oy, w.dy, w.cy);
  double z0 = inCell(t0, w.oz, w.dz, w.cz);
  double x1 = inCell(t1, w.ox, w.dx, w.cx);
  double y1 = inCell(t1, w.oy, w.dy, w.cy);
  double z1 = inCell(t1, w.oz, w.dz, w.cz);
  // Interpolants along x, at t0 and t1, for the four edges of the cell.
  double p00 = along(double(w.v0), double(w.v4), x0);
  double p01 = along(double(w.v1), double(w.v5), x0);
  double p10 = along(double(w.v2), double(w.v6), x0);
  double p11 = along(double(w.v3), double(w.v7), x0);
  double q00 = along(double(w.v0), double(w.v4), x1);
  double q01 = along(double(w.v1), double(w.v5), x1);
  double q10 = along(double(w.v2), double(w.v6), x1);
  double q11 = along(double(w.v3), double(w.v7), x1);
  double a0 = along(p00, p10, y0);
  double a1 = along(p01, p11, y0);
  double b0 = along(p00, p10, y1);
  double b1 = along(p01, p11, y1);
  double c0 = along(q00, q10, y0);
  double c1 = along(q01, q11, y0);
  double d0 = along(q00, q10, y1);
  double d1 = along(q01, q11, y1);
  Cubic cubic;
  cubic.c0 = along(a0, a1, z0);
  cubic.c1 = third(along(a0, a1, z1), along(b0, b1, z0), along(c0, c1, z0));
  cubic.c2 = third(along(b0, b1, z1), along(c0, c1, z1), along(d0, d1, z0));
  cubic.c3 = along(d0, d1, z1);
  double constant = double(w.low);
  bool isConstant = w.number < 0;
  cubic.c0 = isConstant ? constant : cubic.c0;
  cubic.c1 = isConstant ? constant : cubic.c1;
  cubic.c2 = isConstant ? constant : cubic.c2;
  cubic.c3 = isConstant ? constant : cubic.c3;
  return cubic;
}

// Records if the ray is inside the solid from t on, and a crossing at t if it was on the other side
// before.
void settle(bool isInside, double t) {
  int now = isInside ? 1 : 0;
  if (side >= 0 && side != now) {
    REAL longer = inside + (t - from);
    inside = side == 1 ? longer : inside;
    from = t;
    place = t;
    searching = wantsLength != 0;
  }
  side = now;
}

// Settles a segment in which the expression is monotone.
void solve(double t0, double t1) {
  double a = 0.0lf;
  double b = 1.0lf;
  double fa = 0.0lf;
  double fb = 0.0lf;
  int moved = -1;  // 1: the last step has moved a; 0: b
  bool open = true;
  bool crosses = false;
  // The first two rounds evaluate the ends.
  int n = -2;
  while (++steps < kMostSteps && open) {
    REAL share = fa / (fa - fb);
    REAL secant = a + (b - a) * share;
    REAL middle = 0.5lf * (a + b);
    bool bisects = (n & 3) == 3 || !(share > 0.0lf && share < 1.0lf);
    double s = n == -2 ? 0.0lf : (n == -1 ? 1.0lf : (bisects ? middle : secant));
    double f = joinedValue(s);
    if (n < 0) {
      fa = n == -2 ? f : fa;
      fb = f;
      if (n == -1) {
        settle(fa < 0.0lf, t0);
        crosses = searching && (fa < 0.0lf) != (fb < 0.0lf);
        open = crosses;
      }
    } else {
      bool movesA = (f < 0.0lf) == (fa < 0.0lf);
      bool again = moved == (movesA ? 1 : 0);
      double halfA = fa * 0.5lf;
      double halfB = fb * 0.5lf;
      fa = movesA ? f : (again ? halfA : fa);
      fb = movesA ? (again ? halfB : fb) : f;
      a = movesA ? s : a;
      b = movesA ? b : s;
      moved = movesA ? 1 : 0;
    }
    ++n;
    REAL width = b - a;
    open = open && n < 100 && width > kLeastWidth;
  }
  if (crosses) {
    REAL middle = 0.5lf * (a + b);
    REAL crossing = t0 + (t1 - t0) * middle;
    settle(fb < 0.0lf, crossing);
  }
}

// Divides the segment between t0 and t1 in the present cells until each part has one sign or is
// monotone. The part at depth `level` is found by its path: bit n of `path` is set where the
// halving number n chose the right half.
void divide(double t0, double t1) {
#define FILL(g)                      \
  root[g] = cubicOf(walk[g], t0, t1); \
  part[g] = root[g];
  EACH_GRID(FILL)
#undef FILL
  double a = t0;
  double b = t1;
  int level = 0;
  uvec2 path = uvec2(0u);
  bool open = true;
  double noise = numbers[3];
  while (++steps < kMostSteps && open) {
    Bounds all = joinedBounds();
    bool isOut = all.low >= 0.0lf;
    bool isIn = !isOut && all.high < 0.0lf;
    bool isMonotone = all.slopeLow >= 0.0lf || all.slopeHigh <= 0.0lf;
    bool isFlat = greater(-all.low, all.high) < noise;
    bool isKnown = isOut || isIn;
    bool ends = isKnown || isMonotone || isFlat || level == kMostHalvings;
    if (isKnown) settle(isIn, a);
    // llvmpipe executes all branches, but skips loops that no ray enters.
    for (int once = ends && !isKnown ? 0 : 1; once < 1; ++once) solve(a, b);
    int done = level;
    if (ends) {
      // Go on with the right half of the smallest segment of which this part ends the left half.
      uint openHigh = ~path.y & (level > 32 ? (1u << (level - 32)) - 1u : 0u);
      uint openLow = ~path.x & (level > 31 ? 0xffffffffu : (1u << level) - 1u);
      level = openHigh != 0u ? 33 + findMSB(openHigh) : 1 + findMSB(openLow);
      open = searching && level > 0;
      path.x |= level > 0 && level <= 32 ? 1u << (level - 1) : 0u;
      path.y |= level > 32 ? 1u << (level - 33) : 0u;
      done = 0;
      a = t0;
      b = t1;
#define RESTART(g) part[g] = root[g];
      EACH_GRID(RESTART)
#undef RESTART
    } else {
      path.x &= level < 32 ? ~(1u << level) : 0xffffffffu;
      path.y &= level >= 32 ? ~(1u << (level - 32)) : 0xffffffffu;
      ++level;
    }
    while (++steps < kMostSteps && open && done < level) {
      bool isRight = ((done < 32 ? path.x >> done : path.y >> (done - 32)) & 1u) != 0u;
      REAL middle = 0.5lf * (a + b);
      a = isRight ? middle : a;
      b = isRight ? b : middle;
#define HALVE(g) part[g] = halved(part[g], isRight);
      EACH_GRID(HALVE)
#undef HALVE
      ++done;
    }
  }
}

// Follows the ray through the cells of the present blocks, from t to `last`.
void walkCells(double t, double last) {
  bool open = true;
  bool isFirst = true;
  while (++steps < kMostSteps && open) {
    double next = last;
#define STEP(g)                            \
  walkToCell(g, walk[g], t, isFirst);      \
  next = lesser(next, walk[g].cellExit);
    EACH_GRID(STEP)
#undef STEP
    Range all = joinedRange();
    bool isKnown = all.low >= 0.0lf || all.high < 0.0lf;
    if (isKnown) settle(!(all.low >= 0.0lf), t);
    for (int once = isKnown ? 1 : 0; once < 1; ++once) divide(t, next);
    open = searching && next != last;
    t = next;
    isFirst = false;
  }
}

void walkBlocks() {
  double t = 0.0lf;
  while (++steps < kMostSteps && searching && t < end) {
    double next = end;
#define STEP(g)                        \
  walkToBlock(g, walk[g], t);          \
  next = lesser(next, walk[g].blockExit);
    EACH_GRID(STEP)
#undef STEP
    Range all = joinedRange();
    bool isKnown = all.low >= 0.0lf || all.high < 0.0lf;
    if (isKnown) settle(!(all.low >= 0.0lf), t);
    for (int once = isKnown ? 1 : 0; once < 1; ++once) walkCells(t, next);
    t = next;
  }
}

void main() {
  int n = firstRay + int(gl_GlobalInvocationID.x);
  if (n >= rayCount) return;
  int at = 7 * n;
  end = rays[at + 6];
#define START(g)                                                                           \
  walk[g] = started(g, rays[at], rays[at + 1], rays[at + 2], rays[at + 3], rays[at + 4], \
                    rays[at + 5]);
  EACH_GRID(START)
#undef START
  place = never();
  walkBlocks();
  REAL whole = inside + end - from;
  double length_ = side == 1 ? whole : inside;
  double result = wantsLength != 0 ? length_ : place;
  found[n] = steps < kMostSteps ? result : -1.0lf;
}

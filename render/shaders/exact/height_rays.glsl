// First intersection of a ray with the triangles of a height field, in double precision. The code is
// valid GLSL and C++. C++ includes it into a class (render/terrain/rays/height_kernel.h). Both compute
// the same bits.
//
// Positions count in cells along both sides of the grid, and in units of the heights. So the corners of
// the triangles are exact numbers. A shear along the ray moves the ray into an axis [Woop13]. Then the
// sign of a corner's area with the next one tells on which side of an edge the ray passes. This sign is
// exact for the rounded corners, and both triangles of an edge use it. So no ray passes between them.
//
// The text before defines kNoRoot, which is larger than any distance; kMissing, the height of a sample
// without data; kSplitter, 2^27 + 1; kLeastSlope and kMostInverse; cellsU, cellsV and topLevel; firstLeftOutU, lastLeftOutU, firstLeftOutV and lastLeftOutV;
// and the functions heightAt, lowestIn, highestIn and trailingOnes.

// A ray from (u, v, w). Distances along it count in lengths of (du, dv, dw).
struct HeightRay {
  double u, v, w;
  double du, dv, dw;
  double near;        // least distance of an intersection
  double far;         // largest one
  double pad;         // bound on the rounding error of a position
  double iu, iv, iw;  // inverse of the direction
  double sx, sy;      // shear: change along the two other axes, per unit of the main axis
  double sz;          // direction along the main axis
  int axis;           // main axis, of the largest component: 0 is u, 1 is v, 2 is w
};

// The next node on the way of a ray, and the nearest intersection so far. Nodes of level l have the edge
// length 2^l, and count from the side on which the ray enters.
struct HeightWalk {
  int level, i, j;
  double t;
  int column, halfRow;  // triangle: column of its cell, and twice the row, plus 1 for the upper one
};

// A corner of a triangle in the sheared space. The ray is the axis z.
struct HeightCorner {
  double x, y, z;
};

double lesserOf(double a, double b) { return b < a ? b : a; }
double greaterOf(double a, double b) { return a < b ? b : a; }

// The inverse of a component. A ray across the axis stays between two planes or meets neither.
double inverseOf(double d) {
  if (d < kLeastSlope && d > -kLeastSlope) return d < 0.0 ? -kMostInverse : kMostInverse;
  VAR inverse = 1.0 / d;
  return inverse;
}

// Sets the numbers of a ray that follow from others.
void completeRay(RAY_OUT ray) {
  ray.iu = inverseOf(ray.du);
  ray.iv = inverseOf(ray.dv);
  ray.iw = inverseOf(ray.dw);
  double a = ray.du < 0.0 ? -ray.du : ray.du;
  double b = ray.dv < 0.0 ? -ray.dv : ray.dv;
  double c = ray.dw < 0.0 ? -ray.dw : ray.dw;
  ray.axis = a > b && a > c ? 0 : (b > c ? 1 : 2);
  double dx = ray.axis == 0 ? ray.dv : (ray.axis == 1 ? ray.dw : ray.du);
  double dy = ray.axis == 0 ? ray.dw : (ray.axis == 1 ? ray.du : ray.dv);
  ray.sz = ray.axis == 0 ? ray.du : (ray.axis == 1 ? ray.dv : ray.dw);
  VAR sx = dx / ray.sz;
  VAR sy = dy / ray.sz;
  ray.sx = sx;
  ray.sy = sy;
}

int nodesAlong(int cells, int level) { return ((cells - 1) >> level) + 1; }

bool meetsBox(RAY ray, double lowU, double highU, double lowV, double highV, double lowW, double highW,
              double end) {
  VAR enterU = ((ray.iu < 0.0 ? highU + ray.pad : lowU - ray.pad) - ray.u) * ray.iu;
  VAR leaveU = ((ray.iu < 0.0 ? lowU - ray.pad : highU + ray.pad) - ray.u) * ray.iu;
  VAR enterV = ((ray.iv < 0.0 ? highV + ray.pad : lowV - ray.pad) - ray.v) * ray.iv;
  VAR leaveV = ((ray.iv < 0.0 ? lowV - ray.pad : highV + ray.pad) - ray.v) * ray.iv;
  VAR enterW = ((ray.iw < 0.0 ? highW + ray.pad : lowW - ray.pad) - ray.w) * ray.iw;
  VAR leaveW = ((ray.iw < 0.0 ? lowW - ray.pad : highW + ray.pad) - ray.w) * ray.iw;
  double enter = greaterOf(greaterOf(enterU, enterV), greaterOf(enterW, ray.near));
  double leave = lesserOf(lesserOf(leaveU, leaveV), lesserOf(leaveW, end));
  return enter <= leave;
}

HeightCorner shearedCorner(RAY ray, double u, double v, double w) {
  VAR a = u - ray.u;
  VAR b = v - ray.v;
  VAR c = w - ray.w;
  HeightCorner corner;
  corner.z = ray.axis == 0 ? a : (ray.axis == 1 ? b : c);
  VAR x = (ray.axis == 0 ? b : (ray.axis == 1 ? c : a)) - ray.sx * corner.z;
  VAR y = (ray.axis == 0 ? c : (ray.axis == 1 ? a : b)) - ray.sy * corner.z;
  corner.x = x;
  corner.y = y;
  return corner;
}

// The exact difference of a product and its rounded value [Dekker71].
double roundingOf(double a, double b, double product) {
  VAR splitA = kSplitter * a;
  VAR highA = splitA - (splitA - a);
  VAR lowA = a - highA;
  VAR splitB = kSplitter * b;
  VAR highB = splitB - (splitB - b);
  VAR lowB = b - highB;
  VAR rest = ((highA * highB - product) + highA * lowB + lowA * highB) + lowA * lowB;
  return rest;
}

// Twice the area of the triangle of two corners and the ray, positive if the ray is on the left of the
// edge from a to b. Products that differ have the order of their exact values.
double sideOf(HeightCorner a, HeightCorner b) {
  VAR left = a.x * b.y;
  VAR right = a.y * b.x;
  VAR side = left - right;
  if (side == 0.0) {
    VAR rest = roundingOf(a.x, b.y, left) - roundingOf(a.y, b.x, right);
    side = rest;
  }
  return side;
}

// Keeps an intersection with a triangle if it is the nearest. At equal distances the first triangle in
// the order of rows counts, so that the order of the tests has no effect.
void meetTriangle(RAY ray, HeightCorner a, HeightCorner b, HeightCorner c, double ab, double bc, double ca,
                  int column, int halfRow, WALK walk) {
  bool isLeft = ab >= 0.0 && bc >= 0.0 && ca >= 0.0;
  bool isRight = ab <= 0.0 && bc <= 0.0 && ca <= 0.0;
  VAR area = (bc + ca) + ab;
  if (!(isLeft || isRight) || area == 0.0) return;
  VAR z = ((bc * a.z + ca * b.z) + ab * c.z) / area;
  VAR t = z / ray.sz;
  if (!(t >= ray.near && t <= ray.far && t <= walk.t)) return;
  if (t == walk.t && (halfRow > walk.halfRow || (halfRow == walk.halfRow && column >= walk.column))) return;
  walk.t = t;
  walk.column = column;
  walk.halfRow = halfRow;
}

bool isLeftOut(int column, int row) {
  return column >= firstLeftOutU && column <= lastLeftOutU && row >= firstLeftOutV && row <= lastLeftOutV;
}

// Tests both triangles of a cell. The diagonal runs from its corner of least u and v to that of
// greatest u and v.
void meetCell(RAY ray, int column, int row, WALK walk) {
  if (isLeftOut(column, row)) return;
  double lowLow = heightAt(column, row);
  double highHigh = heightAt(column + 1, row + 1);
  if (lowLow == kMissing || highHigh == kMissing) return;
  double highLow = heightAt(column + 1, row);
  double lowHigh = heightAt(column, row + 1);
  double low = lesserOf(lowLow, highHigh);
  double high = greaterOf(lowLow, highHigh);
  if (highLow != kMissing) {
    low = lesserOf(low, highLow);
    high = greaterOf(high, highLow);
  }
  if (lowHigh != kMissing) {
    low = lesserOf(low, lowHigh);
    high = greaterOf(high, lowHigh);
  }
  double u0 = double(column);
  double v0 = double(row);
  double u1 = double(column + 1);
  double v1 = double(row + 1);
  if (!meetsBox(ray, u0, u1, v0, v1, low, high, lesserOf(ray.far, walk.t))) return;
  HeightCorner a = shearedCorner(ray, u0, v0, lowLow);
  HeightCorner c = shearedCorner(ray, u1, v1, highHigh);
  double ca = sideOf(c, a);
  if (highLow != kMissing) {
    HeightCorner b = shearedCorner(ray, u1, v0, highLow);
    meetTriangle(ray, a, b, c, sideOf(a, b), sideOf(b, c), ca, column, 2 * row, walk);
  }
  if (lowHigh != kMissing) {
    HeightCorner d = shearedCorner(ray, u0, v1, lowHigh);
    meetTriangle(ray, a, c, d, -ca, sideOf(c, d), sideOf(d, a), column, 2 * row + 1, walk);
  }
}

// Walks through the pyramid from the front to the back, for some steps or to the end of the ray.
// @param isAny  the walk ends at the first intersection that is found
void walkHeights(RAY ray, bool isAny, int mostSteps, WALK walk) {
  for (int step = 0; step < mostSteps && walk.level <= topLevel; ++step) {
    int level = walk.level;
    int last = (1 << (topLevel - level)) - 1;
    int i = ray.du < 0.0 ? last - walk.i : walk.i;
    int j = ray.dv < 0.0 ? last - walk.j : walk.j;
    bool isInside = i < nodesAlong(cellsU, level) && j < nodesAlong(cellsV, level);
    bool isEntered = false;
    if (isInside && level == 0) meetCell(ray, i, j, walk);
    if (isInside && level > 0) {
      double low = lowestIn(level, i, j);
      double high = highestIn(level, i, j);
      double edge = double(1 << level);
      VAR u = double(i) * edge;
      VAR v = double(j) * edge;
      isEntered = low <= high && meetsBox(ray, u, u + edge, v, v + edge, low, high, lesserOf(ray.far, walk.t));
    }
    if (isAny && walk.t < kNoRoot) {
      walk.level = topLevel + 1;
    } else if (isEntered) {
      walk.level = level - 1;
      walk.i = 2 * walk.i;
      walk.j = 2 * walk.j;
    } else {
      // The next of the four children of the parent, or that of an ancestor.
      int up = trailingOnes(walk.i & walk.j);
      walk.level = level + up;
      walk.i = walk.i >> up;
      walk.j = walk.j >> up;
      if (walk.level == topLevel) {
        walk.level = topLevel + 1;
      } else if ((walk.i & 1) == 0) {
        walk.i = walk.i + 1;
      } else {
        walk.i = walk.i - 1;
        walk.j = walk.j + 1;
      }
    }
  }
}

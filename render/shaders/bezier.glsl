// Nodes of subdivision trees of Bézier volumes, in double precision. The bits are those of
// render/bezier/tree_node.cpp and tree_walk.h: sums, products, quotients and comparisons in the same
// order, and correctly rounded square roots.
//
// A node has N components for each control point (points), and numbers (heads) whose positions are
// given by the constants below. The degrees of all nodes of a run are equal. kWeight is the component
// of the weight of projected points.

const int kHead = 50;  // numbers of a node
const int kLeft = 0, kRight = 1, kTop = 2, kBottom = 3;  // box on the screen
const int kLeastDepth = 4;  // lower bound of the depths of roots
const int kCentre = 5;
const int kInverse = 7;
const int kLow = 16, kHigh = 19;  // box along the axes of the inverse Jacobian
const int kMiddle = 22;
const int kCentreWeight = 25;
const int kAcross = 26;  // bounds of derivatives
const int kScale = 35;   // largest magnitudes of the components of the patch
const int kFlags = 40, kLevel = 41, kCell = 42, kPatch = 45;  // kPatch: patch and attribute
const int kProven = 47;  // 1 for each row of the Jacobian that is diagonally dominant
const int kKept = 1, kCrossesEye = 2, kHasFrame = 4;

const double kNodeRounding = 2e-15lf;
const double kLeastDeterminant = 1e-11lf;
const double kProofMargin = 1e-6lf;
const double kRootReach = 2e-6lf, kDepthRounding = 2e-13lf, kMostDepthRatio = 1e5lf;
const double kFaceTolerance = 1e-9lf, kLastStep = 1e-8lf;
const int kDeepestLevel = 24, kMostNewtonSteps = 24;

double lesser(double a, double b) { return b < a ? b : a; }
double greater(double a, double b) { return a < b ? b : a; }
double held(double a, double low, double high) { return a < low ? low : (high < a ? high : a); }
double magnitude(double a) { return a < 0.0lf ? -a : a; }
bool isFinite(double a) { return (unpackDouble2x32(a).y & 0x7ff00000u) != 0x7ff00000u; }

int pointCount() { return order0 * order1 * order2; }
int flagsOf(int node) { return int(heads[kHead * node + kFlags]); }

// Bernstein polynomials of one degree and their derivatives.
struct BernsteinRow {
  double value[kMostOrder];
  double slope[kMostOrder];
};

BernsteinRow bernsteinRow(int order, double t) {
  BernsteinRow row;
  precise double rest = 1.0lf - t;
  row.value[0] = 1.0lf;
  for (int step = 1; step < order; ++step) {
    if (step == order - 1) {  // the derivatives are those of the degree below
      precise double before = 0.0lf;
      for (int i = 0; i < step; ++i) {
        precise double change = double(step) * (before - row.value[i]);
        row.slope[i] = change;
        before = row.value[i];
      }
      precise double last = double(step) * before;
      row.slope[step] = last;
    }
    precise double carried = 0.0lf;
    for (int i = 0; i < step; ++i) {
      double v = row.value[i];
      precise double sum = carried + rest * v;
      row.value[i] = sum;
      carried = t * v;
    }
    row.value[step] = carried;
  }
  return row;
}

// Values and derivatives of the components at a point.
precise double jetValue[N];
precise double jetU[N];
precise double jetV[N];
precise double jetW[N];

void computeJet(int node, double u, double v, double w) {
  BernsteinRow bu = bernsteinRow(order0, u);
  BernsteinRow bv = bernsteinRow(order1, v);
  BernsteinRow bw = bernsteinRow(order2, w);
  int at = node * pointCount() * N;
  for (int c = 0; c < N; ++c) {
    jetValue[c] = 0.0lf;
    jetU[c] = 0.0lf;
    jetV[c] = 0.0lf;
    jetW[c] = 0.0lf;
  }
  for (int i = 0; i < order0; ++i) {
    precise double plane[N], planeV[N], planeW[N];
    for (int c = 0; c < N; ++c) {
      plane[c] = 0.0lf;
      planeV[c] = 0.0lf;
      planeW[c] = 0.0lf;
    }
    for (int j = 0; j < order1; ++j) {
      precise double row[N], rowW[N];
      for (int c = 0; c < N; ++c) {
        row[c] = 0.0lf;
        rowW[c] = 0.0lf;
      }
      for (int k = 0; k < order2; ++k) {
        double value = bw.value[k];
        double slope = bw.slope[k];
        for (int c = 0; c < N; ++c) {
          double number = points[at + c];
          row[c] = row[c] + value * number;
          rowW[c] = rowW[c] + slope * number;
        }
        at += N;
      }
      double value = bv.value[j];
      double slope = bv.slope[j];
      for (int c = 0; c < N; ++c) {
        plane[c] = plane[c] + value * row[c];
        planeV[c] = planeV[c] + slope * row[c];
        planeW[c] = planeW[c] + value * rowW[c];
      }
    }
    double value = bu.value[i];
    double slope = bu.slope[i];
    for (int c = 0; c < N; ++c) {
      jetValue[c] = jetValue[c] + value * plane[c];
      jetU[c] = jetU[c] + slope * plane[c];
      jetV[c] = jetV[c] + value * planeV[c];
      jetW[c] = jetW[c] + value * planeW[c];
    }
  }
}

// Derivative of a component by a parameter.
double jetSlope(int axis, int c) { return axis == 0 ? jetU[c] : (axis == 1 ? jetV[c] : jetW[c]); }

struct Three {
  double x, y, z;
};

Three crossOf(Three a, Three b) {
  Three c;
  precise double x = a.y * b.z - a.z * b.y;
  precise double y = a.z * b.x - a.x * b.z;
  precise double z = a.x * b.y - a.y * b.x;
  c.x = x;
  c.y = y;
  c.z = z;
  return c;
}

double dotOf(Three a, Three b) {
  precise double sum = a.x * b.x + a.y * b.y + a.z * b.z;
  return sum;
}

// Constraints of a screen position at the point of the jet: X − x W, Y − y W and A.
double constraintAt(int row, double x, double y) {
  precise double value =
      row == 2 ? jetValue[3] : jetValue[row] - (row == 0 ? x : y) * jetValue[kWeight];
  return value;
}

// Row of their Jacobian.
Three slopesOf(int row, double x, double y) {
  Three slopes;
  double at = row == 0 ? x : y;
  precise double u = row == 2 ? jetU[3] : jetU[row] - at * jetU[kWeight];
  precise double v = row == 2 ? jetV[3] : jetV[row] - at * jetV[kWeight];
  precise double w = row == 2 ? jetW[3] : jetW[row] - at * jetW[kWeight];
  slopes.x = u;
  slopes.y = v;
  slopes.z = w;
  return slopes;
}

// Sets a row of the inverse Jacobian.
void setInverse(int at, int row, Three c0, Three c1, Three c2, double determinant) {
  precise double a = (row == 0 ? c0.x : (row == 1 ? c0.y : c0.z)) / determinant;
  precise double b = (row == 0 ? c1.x : (row == 1 ? c1.y : c1.z)) / determinant;
  precise double c = (row == 0 ? c2.x : (row == 1 ? c2.y : c2.z)) / determinant;
  heads[at + kInverse + 3 * row] = a;
  heads[at + kInverse + 3 * row + 1] = b;
  heads[at + kInverse + 3 * row + 2] = c;
}

// Value of a row of G at a control point. @param point  address of the point
double combined(int at, int row, double offset, int point) {
  precise double sum = heads[at + kInverse + 3 * row] * points[point] +
                       heads[at + kInverse + 3 * row + 1] * points[point + 1] +
                       heads[at + kInverse + 3 * row + 2] * points[point + 3] -
                       offset * points[point + kWeight];
  return sum;
}

double offsetOf(int at, int row) {
  precise double offset = heads[at + kInverse + 3 * row] * heads[at + kCentre] +
                          heads[at + kInverse + 3 * row + 1] * heads[at + kCentre + 1];
  return offset;
}

// As TreeNodes::addFrame().
void addFrame(int node) {
  int at = kHead * node;
  int flags = flagsOf(node);
  if ((flags & kCrossesEye) != 0) return;
  computeJet(node, 0.5lf, 0.5lf, 0.5lf);
  double weight = jetValue[kWeight];
  precise double bx = jetValue[0] / weight;
  precise double by = jetValue[1] / weight;
  heads[at + kCentreWeight] = weight;
  heads[at + kCentre] = bx;
  heads[at + kCentre + 1] = by;
  Three r0 = slopesOf(0, bx, by);
  Three r1 = slopesOf(1, bx, by);
  Three r2 = slopesOf(2, bx, by);
  Three c0 = crossOf(r1, r2);
  Three c1 = crossOf(r2, r0);
  Three c2 = crossOf(r0, r1);
  double determinant = dotOf(r0, c0);
  precise double squares = dotOf(r0, r0) * dotOf(r1, r1) * dotOf(r2, r2);
  precise double least = kLeastDeterminant * rootOf(squares);
  if (!(magnitude(determinant) > least)) return;
  heads[at + kFlags] = double(flags | kHasFrame);
  for (int r = 0; r < 3; ++r) setInverse(at, r, c0, c1, c2, determinant);
  int first = node * pointCount() * N;
  double leastWeight = points[first + kWeight];
  for (int n = 1; n < pointCount(); ++n)
    leastWeight = lesser(leastWeight, points[first + N * n + kWeight]);
  for (int r = 0; r < 3; ++r) {
    double offset = offsetOf(at, r);
    double low = 0.0lf;
    double high = 0.0lf;
    for (int n = 0; n < pointCount(); ++n) {
      int point = first + N * n;
      precise double quotient = combined(at, r, offset, point) / points[point + kWeight];
      low = n == 0 ? quotient : lesser(low, quotient);
      high = n == 0 ? quotient : greater(high, quotient);
    }
    double m0 = heads[at + kInverse + 3 * r];
    double m1 = heads[at + kInverse + 3 * r + 1];
    double m2 = heads[at + kInverse + 3 * r + 2];
    precise double noise =
        kNodeRounding / leastWeight *
        (magnitude(m0) * (heads[at + kScale] + magnitude(bx) * heads[at + kScale + kWeight]) +
         magnitude(m1) * (heads[at + kScale + 1] + magnitude(by) * heads[at + kScale + kWeight]) +
         magnitude(m2) * heads[at + kScale + 3]);
    precise double lowest = low - noise;
    precise double highest = high + noise;
    precise double middle = m2 * jetValue[3];
    heads[at + kLow + r] = lowest;
    heads[at + kHigh + r] = highest;
    heads[at + kMiddle + r] = middle;
  }
}

// As TreeNodes::prove(), for one row of the Jacobian.
void prove(int node, int r) {
  int at = kHead * node;
  if ((flagsOf(node) & kHasFrame) == 0) return;
  int first = node * pointCount() * N;
  double offset = offsetOf(at, r);
  double low = heads[at + kLow + r];
  double high = heads[at + kHigh + r];
  double least = 0.0lf;
  precise double sum = kProofMargin;
  for (int axis = 0; axis < 3; ++axis) {
    int order = axis == 0 ? order0 : (axis == 1 ? order1 : order2);
    int stride = axis == 0 ? order1 * order2 : (axis == 1 ? order2 : 1);
    double smallest = 0.0lf;
    double largest = 0.0lf;
    bool isFirst = true;
    for (int n = 0; n + stride < pointCount(); ++n) {
      if (n / stride % order == order - 1) continue;
      int point = first + N * n;
      int next = point + N * stride;
      precise double change = combined(at, r, offset, next) - combined(at, r, offset, point);
      precise double other = points[next + kWeight] - points[point + kWeight];
      precise double a = change - low * other;
      precise double b = change - high * other;
      smallest = isFirst ? a : lesser(smallest, a);
      largest = isFirst ? a : greater(largest, a);
      smallest = lesser(smallest, b);
      largest = greater(largest, b);
      isFirst = false;
    }
    double degree = double(order - 1);
    precise double lowest = degree * smallest;
    precise double most = degree * greater(largest, -smallest);
    least = axis == r ? lowest : least;
    double across = axis == r ? 0.0lf : most;
    heads[at + kAcross + 3 * r + axis] = across;
    sum = sum + across;
  }
  heads[at + kProven + r] = least > sum ? 1.0lf : 0.0lf;
}

bool isUnique(int node) {
  int at = kHead * node + kProven;
  return heads[at] > 0.0lf && heads[at + 1] > 0.0lf && heads[at + 2] > 0.0lf;
}

// As TreeNodes::bound(). The head has the scale of the components.
void bound(int node, double near, double far) {
  int at = kHead * node;
  int first = node * pointCount() * N;
  heads[at + kFlags] = 0.0lf;
  for (int r = 0; r < 3; ++r) heads[at + kProven + r] = 0.0lf;
  double valueLow = points[first + 3], valueHigh = valueLow;
  double weightedLow = points[first + 2], weightedHigh = weightedLow;
  double ratioLow = points[first + N - 1], ratioHigh = ratioLow;
  double depthLow = 0.0lf, depthHigh = 0.0lf;
  for (int n = 0; n < pointCount(); ++n) {
    int point = first + N * n;
    valueLow = lesser(valueLow, points[point + 3]);
    valueHigh = greater(valueHigh, points[point + 3]);
    weightedLow = lesser(weightedLow, points[point + 2]);
    weightedHigh = greater(weightedHigh, points[point + 2]);
    ratioLow = lesser(ratioLow, points[point + N - 1]);
    ratioHigh = greater(ratioHigh, points[point + N - 1]);
    precise double quotient =
        N == 5 ? points[point + 2] / points[point + N - 1] : points[point + 2];
    depthLow = n == 0 ? quotient : lesser(depthLow, quotient);
    depthHigh = n == 0 ? quotient : greater(depthHigh, quotient);
  }
  precise double flatness = kNodeRounding * heads[at + kScale + 3];
  if (valueLow > flatness || valueHigh < -flatness) return;
  precise double ratio = N == 5 ? ratioHigh / ratioLow : 1.0lf;
  precise double least =
      depthLow - ratio * (kRootReach * (depthHigh - depthLow) +
                          kDepthRounding * greater(magnitude(depthLow), depthHigh));
  heads[at + kLeastDepth] = ratio < kMostDepthRatio ? least : -1e300lf;
  precise double thick = kNodeRounding * heads[at + kScale + 2];
  precise double farthest = depthHigh + thick;
  precise double nearest = depthLow - thick;
  if (farthest < near || nearest > far) return;
  if (isPerspective) {
    if (!(weightedHigh > 0.0lf)) return;
    precise double share = 1e-9lf * weightedHigh;
    if (!(weightedLow > share)) {
      heads[at + kFlags] = double(kKept | kCrossesEye);
      return;
    }
  }
  double left = 0.0lf, right = 0.0lf, top = 0.0lf, bottom = 0.0lf;
  double leastWeight = points[first + kWeight];
  for (int n = 0; n < pointCount(); ++n) {
    int point = first + N * n;
    double weight = points[point + kWeight];
    precise double x = points[point] / weight;
    precise double y = points[point + 1] / weight;
    left = n == 0 ? x : lesser(left, x);
    right = n == 0 ? x : greater(right, x);
    top = n == 0 ? y : lesser(top, y);
    bottom = n == 0 ? y : greater(bottom, y);
    leastWeight = lesser(leastWeight, weight);
  }
  precise double noise = kNodeRounding / leastWeight;
  precise double noiseX = noise * heads[at + kScale];
  precise double noiseY = noise * heads[at + kScale + 1];
  precise double lowX = left - noiseX;
  precise double highX = right + noiseX;
  precise double lowY = top - noiseY;
  precise double highY = bottom + noiseY;
  heads[at + kLeft] = lowX;
  heads[at + kRight] = highX;
  heads[at + kTop] = lowY;
  heads[at + kBottom] = highY;
  heads[at + kFlags] = double(kKept);
}

// As TreeNodes::mayCross().
bool mayCross(int node, double x, double y) {
  int first = node * pointCount() * N;
  double left = 0.0lf, right = 0.0lf, top = 0.0lf, bottom = 0.0lf;
  for (int n = 0; n < pointCount(); ++n) {
    int point = first + N * n;
    precise double a = points[point] - x * points[point + kWeight];
    precise double b = points[point + 1] - y * points[point + kWeight];
    left = n == 0 ? a : lesser(left, a);
    right = n == 0 ? a : greater(right, a);
    top = n == 0 ? b : lesser(top, b);
    bottom = n == 0 ? b : greater(bottom, b);
  }
  return left <= 0.0lf && right >= 0.0lf && top <= 0.0lf && bottom >= 0.0lf;
}

// Offset of a screen position along a row of the inverse Jacobian.
double alongRow(int at, int row, double x, double y) {
  precise double offset = heads[at + kInverse + 3 * row] * x + heads[at + kInverse + 3 * row + 1] * y;
  return offset;
}

// True if a screen position is in the oriented box of a node, or there is no such box.
bool isInFrame(int node, double x, double y) {
  int at = kHead * node;
  if ((flagsOf(node) & kHasFrame) == 0) return true;
  precise double dx = x - heads[at + kCentre];
  precise double dy = y - heads[at + kCentre + 1];
  bool isInside = true;
  for (int r = 0; r < 3; ++r) {
    double s = alongRow(at, r, dx, dy);
    isInside = isInside && s >= heads[at + kLow + r] && s <= heads[at + kHigh + r];
  }
  return isInside;
}

// Start of Newton's method.
double startOf(int node, int axis, double x, double y) {
  int at = kHead * node;
  precise double dx = x - heads[at + kCentre];
  precise double dy = y - heads[at + kCentre + 1];
  precise double start =
      0.5lf - heads[at + kMiddle + axis] + alongRow(at, axis, dx, dy) * heads[at + kCentreWeight];
  return held(start, 0.0lf, 1.0lf);
}

// Step of Newton's method from the point of the jet. @return false where the Jacobian is singular
bool newtonStep(double x, double y, out Three change) {
  Three r0 = slopesOf(0, x, y);
  Three r1 = slopesOf(1, x, y);
  Three r2 = slopesOf(2, x, y);
  Three c0 = crossOf(r1, r2);
  Three c1 = crossOf(r2, r0);
  Three c2 = crossOf(r0, r1);
  double f0 = constraintAt(0, x, y);
  double f1 = constraintAt(1, x, y);
  double f2 = constraintAt(2, x, y);
  double determinant = dotOf(r0, c0);
  precise double a = -(c0.x * f0 + c1.x * f1 + c2.x * f2) / determinant;
  precise double b = -(c0.y * f0 + c1.y * f1 + c2.y * f2) / determinant;
  precise double c = -(c0.z * f0 + c1.z * f1 + c2.z * f2) / determinant;
  change.x = a;
  change.y = b;
  change.z = c;
  return !(determinant == 0.0lf || !isFinite(determinant));
}

// True if the jet at a face of the node, nearest to a root beyond it, proves that the node has no
// root. @param beyond  parameters of that root
bool isExcluded(int node, double x, double y, Three beyond) {
  int at = kHead * node;
  double f0 = constraintAt(0, x, y);
  double f1 = constraintAt(1, x, y);
  double f2 = constraintAt(2, x, y);
  bool isProven = false;
  for (int r = 0; r < 3; ++r) {
    double past = r == 0 ? beyond.x : (r == 1 ? beyond.y : beyond.z);
    if (past == held(past, 0.0lf, 1.0lf)) continue;
    precise double g = heads[at + kInverse + 3 * r] * f0 + heads[at + kInverse + 3 * r + 1] * f1 +
                       heads[at + kInverse + 3 * r + 2] * f2;
    precise double most = kFaceTolerance;
    for (int c = 0; c < 3; ++c) {
      double on = held(c == 0 ? beyond.x : (c == 1 ? beyond.y : beyond.z), 0.0lf, 1.0lf);
      precise double rest = 1.0lf - on;
      precise double reach = heads[at + kAcross + 3 * r + c] * greater(on, rest);
      if (c != r) most = most + reach;
    }
    isProven = isProven || (past > 1.0lf ? g < -most : g > most);
  }
  return isProven;
}

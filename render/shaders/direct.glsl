// Direct volume rendering: the light of a volume along a ray, by the closed forms of
// render/direct/direct_volume.h. The code is valid GLSL and C++, in double precision, and follows
// grid_walk.glsl and transfer.glsl. It uses sums, products, quotients, square roots and comparisons
// alone, which IEEE 754 defines to the last bit.
//
// Coordinates are those of the grid: points have integer coordinates, starting at 0.

// Only peaks of the transfer function that are thinner than 1e-4 of the values in a cell need more.
CONST_INT kMostPieces = 4096;

// A ray and the light on it so far. Distances are in world units.
struct VolumeRay {
  double fromX, fromY, fromZ;  // position at the distance 0
  double stepX, stepY, stepZ;  // its derivative by the distance
  double t, end;               // start of the present cell or block, and end of the ray
  double passed;               // transmittance
  double red, green, blue;
  int x, y, z;  // cell
  int pieces;   // pieces of the present cell that are done; kEnded after the end of the ray
};
CONST_INT kEnded = -1;

double doubledOnce(double absorbed, bool applies) {
  VAR twice = absorbed * (2.0 - absorbed);
  return applies ? twice : absorbed;
}

// 1 − exp(−depth), for a depth of at least 0. The depth is halved until a few terms of the series
// suffice: with a = 1 − exp(−d), twice the depth has a (2 − a). No loop, because drivers limit the
// iterations of loops.
double absorbedBy(double depth) {
  if (depth > 64.0) return 1.0;
  VAR d = depth;
  d = depth > 4.0 ? d * 0.03125 : d;
  int halvings = depth > 4.0 ? 5 : 0;
  bool isAboveTwo = d > 2.0;
  d = isAboveTwo ? d * 0.5 : d;
  halvings += isAboveTwo ? 1 : 0;
  bool isAboveOne = d > 1.0;
  d = isAboveOne ? d * 0.5 : d;
  halvings += isAboveOne ? 1 : 0;
  bool isAboveHalf = d > 0.5;
  d = isAboveHalf ? d * 0.5 : d;
  halvings += isAboveHalf ? 1 : 0;
  bool isAboveQuarter = d > 0.25;
  d = isAboveQuarter ? d * 0.5 : d;
  halvings += isAboveQuarter ? 1 : 0;
  bool isAboveEighth = d > 0.125;
  d = isAboveEighth ? d * 0.5 : d;
  halvings += isAboveEighth ? 1 : 0;
  VAR sum = 1.0 - d * INVERSE(10);
  sum = 1.0 - d * INVERSE(9) * sum;
  sum = 1.0 - d * INVERSE(8) * sum;
  sum = 1.0 - d * INVERSE(7) * sum;
  sum = 1.0 - d * INVERSE(6) * sum;
  sum = 1.0 - d * INVERSE(5) * sum;
  sum = 1.0 - d * INVERSE(4) * sum;
  sum = 1.0 - d * INVERSE(3) * sum;
  sum = 1.0 - d * INVERSE(2) * sum;
  VAR absorbed = d * sum;
  if (halvings > 0) {
    absorbed = doubledOnce(absorbed, true);
    absorbed = doubledOnce(absorbed, halvings > 1);
    absorbed = doubledOnce(absorbed, halvings > 2);
    absorbed = doubledOnce(absorbed, halvings > 3);
    absorbed = doubledOnce(absorbed, halvings > 4);
    absorbed = doubledOnce(absorbed, halvings > 5);
    absorbed = doubledOnce(absorbed, halvings > 6);
    absorbed = doubledOnce(absorbed, halvings > 7);
    absorbed = doubledOnce(absorbed, halvings > 8);
    absorbed = doubledOnce(absorbed, halvings > 9);
  }
  return absorbed;
}

double valueAt(int x, int y, int z) {
  VAR value = scaleSlope * numberAt(x, y, z) + scaleIntercept;
  return value;
}

CellCorners cornersOf(int x, int y, int z) {
  CellCorners f;
  f.f0 = valueAt(x, y, z);
  f.f1 = valueAt(x, y, z + 1);
  f.f2 = valueAt(x, y + 1, z);
  f.f3 = valueAt(x, y + 1, z + 1);
  f.f4 = valueAt(x + 1, y, z);
  f.f5 = valueAt(x + 1, y, z + 1);
  f.f6 = valueAt(x + 1, y + 1, z);
  f.f7 = valueAt(x + 1, y + 1, z + 1);
  return f;
}

// Sums of the slopes of the values at the corners of a cell, per grid spacing.
struct Slope {
  double x, y, z;
};

double difference(double high, double low, int points) {
  VAR slope = (high - low) / double(points > 0 ? points : 1);
  return points > 0 ? slope : 0.0;
}

// Adds the slope at one corner of a cell: central differences, one-sided at the border of the grid.
void addSlope(INOUT(Slope) slope, int x, int y, int z, double weight) {
  int lowX = x > 0 ? x - 1 : x;
  int lowY = y > 0 ? y - 1 : y;
  int lowZ = z > 0 ? z - 1 : z;
  int highX = x + 1 < pointsX ? x + 1 : x;
  int highY = y + 1 < pointsY ? y + 1 : y;
  int highZ = z + 1 < pointsZ ? z + 1 : z;
  VAR sumX = slope.x + weight * difference(numberAt(highX, y, z), numberAt(lowX, y, z), highX - lowX);
  VAR sumY = slope.y + weight * difference(numberAt(x, highY, z), numberAt(x, lowY, z), highY - lowY);
  VAR sumZ = slope.z + weight * difference(numberAt(x, y, highZ), numberAt(x, y, lowZ), highZ - lowZ);
  slope.x = sumX;
  slope.y = sumY;
  slope.z = sumZ;
}

// Brightness at the position (a, b, c) in a cell, by the direction of the gradient there.
double brightnessIn(int x, int y, int z, double a, double b, double c) {
  Slope slope;
  slope.x = 0.0;
  slope.y = 0.0;
  slope.z = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    int i = corner >> 2;
    int j = (corner >> 1) & 1;
    int k = corner & 1;
    VAR weightX = i > 0 ? a : 1.0 - a;
    VAR weightY = j > 0 ? b : 1.0 - b;
    VAR weightZ = k > 0 ? c : 1.0 - c;
    VAR weight = weightX * weightY * weightZ;
    addSlope(slope, x + i, y + j, z + k, weight);
  }
  VAR sx = slope.x * scaleSlope;
  VAR sy = slope.y * scaleSlope;
  VAR sz = slope.z * scaleSlope;
  // Gradients are transformed by the inverse transpose of the map from index to world space.
  VAR gx = worldToIndex(0) * sx + worldToIndex(1) * sy + worldToIndex(2) * sz;
  VAR gy = worldToIndex(3) * sx + worldToIndex(4) * sy + worldToIndex(5) * sz;
  VAR gz = worldToIndex(6) * sx + worldToIndex(7) * sy + worldToIndex(8) * sz;
  VAR square = gx * gx + gy * gy + gz * gz;
  VAR size = rootOf(square);
  double divisor = size > 0.0 ? size : 1.0;
  // The outside has smaller values. A weak gradient is no surface and gets the full light.
  VAR towards = 0.0 - (gx * toLightX + gy * toLightY + gz * toLightZ) / divisor;
  VAR strength = size / (divisor + plainGradient);
  VAR brightness = 1.0 - strength * (1.0 - ambientLight) * (1.0 - greater(towards, 0.0));
  return size > 0.0 ? brightness : 1.0;
}

// Adds a piece on which the values go linearly from `from` to `to`. @param length  world units
void addLinear(INOUT(VolumeRay) ray, double from, double to, double length, double brightness,
               INOUT(int) steps) {
  int n = firstPiece(from, to, steps);
  double at = from;
  bool isLast = false;
  ++steps;
  while (!isLast) {
    ++steps;
    Part part = nextPart(from, to, n, at);
    isLast = part.isLast;
    if (part.share > 0.0 && part.extinction > 0.0) {
      VAR depth = part.extinction * part.share * length;
      double absorbed = absorbedBy(depth);
      VAR weight = brightness * ray.passed * absorbed / part.extinction;
      VAR red = ray.red + part.red * weight;
      VAR green = ray.green + part.green * weight;
      VAR blue = ray.blue + part.blue * weight;
      VAR passed = ray.passed * (1.0 - absorbed);
      ray.red = red;
      ray.green = green;
      ray.blue = blue;
      ray.passed = passed;
    }
  }
}

// Number of linear pieces for a cubic: the least n of which n² is at least `square`, and n at least
// `least`. A rounded root would depend on the driver.
int pieceCountOf(double square, double least, INOUT(int) steps) {
  double most = double(kMostPieces);
  if (!(square < most * most && least < most)) return kMostPieces;
  int n = int(sqrt(float(square)));
  steps += 2;
  while (n > 0 && double(n - 1) * double(n - 1) >= square) {
    n = n - 1;
    ++steps;
  }
  while (double(n) * double(n) < square) {
    n = n + 1;
    ++steps;
  }
  n = double(n) < least ? int(least) : n;
  n = double(n) < least ? n + 1 : n;
  return n > 1 ? n : 1;
}

// Adds the light of a cell, from ray.t to `exit`, or goes on with it. At least one piece is done. If
// the number of steps does not suffice for all of them, ray.pieces is above 0 afterwards.
void addCell(INOUT(VolumeRay) ray, double exit, INOUT(int) steps, int mostSteps) {
  CellCorners f = cornersOf(ray.x, ray.y, ray.z);
  double low = lesser(lesser(lesser(f.f0, f.f1), lesser(f.f2, f.f3)),
                      lesser(lesser(f.f4, f.f5), lesser(f.f6, f.f7)));
  double high = greater(greater(greater(f.f0, f.f1), greater(f.f2, f.f3)),
                        greater(greater(f.f4, f.f5), greater(f.f6, f.f7)));
  Bounds bounds = boundsBetween(low, high, steps);
  VAR length = exit - ray.t;
  if (!(length > 0.0) || bounds.extinction == 0.0) return;
  double x0 = inCell(ray.fromX, ray.stepX, ray.t, ray.x);
  double y0 = inCell(ray.fromY, ray.stepY, ray.t, ray.y);
  double z0 = inCell(ray.fromZ, ray.stepZ, ray.t, ray.z);
  double x1 = inCell(ray.fromX, ray.stepX, exit, ray.x);
  double y1 = inCell(ray.fromY, ray.stepY, exit, ray.y);
  double z1 = inCell(ray.fromZ, ray.stepZ, exit, ray.z);
  // Along the ray the interpolant is a cubic. Its Bernstein coefficients are values of the blossom.
  double b0 = blossomAt(f, x0, y0, z0);
  double b1 = third(blossomAt(f, x1, y0, z0), blossomAt(f, x0, y1, z0), blossomAt(f, x0, y0, z1));
  double b2 = third(blossomAt(f, x1, y1, z0), blossomAt(f, x1, y0, z1), blossomAt(f, x0, y1, z1));
  double b3 = blossomAt(f, x1, y1, z1);
  double brightness = 1.0;
  if (isShaded) {
    VAR middle = 0.5 * (ray.t + exit);
    brightness = brightnessIn(ray.x, ray.y, ray.z, inCell(ray.fromX, ray.stepX, middle, ray.x),
                              inCell(ray.fromY, ray.stepY, middle, ray.y),
                              inCell(ray.fromZ, ray.stepZ, middle, ray.z));
    steps += 9;
  }
  // The mean of a cubic on its n linear pieces differs by half its second difference over n².
  VAR bendLow = b0 - 2.0 * b1 + b2;
  VAR bendHigh = b1 - 2.0 * b2 + b3;
  VAR square = 0.5 * greater(magnitude(bendLow), magnitude(bendHigh)) * bounds.slope * length / tolerance;
  // Deep pieces are split, so that light from their far ends is absorbed.
  VAR deep = bounds.extinction * length * piecesPerDepth;
  int count = pieceCountOf(square, deep, steps);
  int n = ray.pieces;
  VAR share = double(n) / double(count);
  double value = n == 0 ? b0 : cubicAt(b0, b1, b2, b3, share);
  VAR pieceLength = length / double(count);
  ++steps;
  while (n < count && ray.passed >= leastPassed && (n == ray.pieces || steps < mostSteps)) {
    ++n;
    ++steps;
    share = double(n) / double(count);
    double next = n == count ? b3 : cubicAt(b0, b1, b2, b3, share);
    addLinear(ray, value, next, pieceLength, brightness, steps);
    value = next;
  }
  ray.pieces = n < count ? n : 0;
  if (ray.passed < leastPassed) {
    // As for surfaces, the last point counts as opaque.
    VAR whole = 1.0 - ray.passed;
    VAR red = ray.red / whole;
    VAR green = ray.green / whole;
    VAR blue = ray.blue / whole;
    ray.red = red;
    ray.green = green;
    ray.blue = blue;
    ray.passed = 0.0;
    ray.pieces = kEnded;
  }
}

// Edge of the box of cells around a cell that is passed in one step: a group or block without
// extinction, or the cell itself.
int stepAt(int x, int y, int z) {
  int group = ((x >> 6) * groupsY + (y >> 6)) * groupsZ + (z >> 6);
  int block = ((x >> 3) * blocksY + (y >> 3)) * blocksZ + (z >> 3);
  return !groupHasExtinction(group) ? 64 : (!blockHasExtinction(block) ? 8 : 1);
}

// Follows a ray until it ends. If more than `mostSteps` iterations of loops are needed, ray.pieces
// is not kEnded, and the next call goes on.
void follow(INOUT(VolumeRay) ray, int mostSteps) {
  VAR perX = 1.0 / (ray.stepX == 0.0 ? 1.0 : ray.stepX);
  VAR perY = 1.0 / (ray.stepY == 0.0 ? 1.0 : ray.stepY);
  VAR perZ = 1.0 / (ray.stepZ == 0.0 ? 1.0 : ray.stepZ);
  int steps = 0;
  while (ray.pieces != kEnded && steps < mostSteps) {
    ++steps;
    int size = stepAt(ray.x, ray.y, ray.z);
    int lowX = ray.x & (0 - size);
    int lowY = ray.y & (0 - size);
    int lowZ = ray.z & (0 - size);
    double exitX = leaves(lowX, size, ray.fromX, ray.stepX, perX, ray.end);
    double exitY = leaves(lowY, size, ray.fromY, ray.stepY, perY, ray.end);
    double exitZ = leaves(lowZ, size, ray.fromZ, ray.stepZ, perZ, ray.end);
    int across = exitX < ray.end ? 0 : 3;
    double exit = lesser(ray.end, exitX);
    across = exitY < exit ? 1 : across;
    exit = lesser(exit, exitY);
    across = exitZ < exit ? 2 : across;
    exit = lesser(exit, exitZ);
    exit = greater(exit, ray.t);
    if (size == 1) addCell(ray, exit, steps, mostSteps);
    if (ray.pieces == 0) {
      int x = nextCell(ray.x, lowX, size, 0, across, ray.fromX, ray.stepX, perX, exit);
      int y = nextCell(ray.y, lowY, size, 1, across, ray.fromY, ray.stepY, perY, exit);
      int z = nextCell(ray.z, lowZ, size, 2, across, ray.fromZ, ray.stepZ, perZ, exit);
      bool isOut = across == 3 || x < 0 || y < 0 || z < 0 || x > pointsX - 2 || y > pointsY - 2 ||
                   z > pointsZ - 2;
      ray.t = exit;
      ray.x = isOut ? ray.x : x;
      ray.y = isOut ? ray.y : y;
      ray.z = isOut ? ray.z : z;
      ray.pieces = isOut || !(exit < ray.end) ? kEnded : 0;
    }
  }
}

// Crossings of a ray with the interfaces of a segmented field. The code is valid GLSL and C++, in
// double precision, and follows grid_walk.glsl. C++ includes it into a class
// (render/segmented/interface_kernel.h).
//
// A position belongs to the region with the least excess, the trilinear interpolant of the distances
// from the grid points to the interface with that region, 0 at points of the region itself. Along a
// ray each excess is a cubic in a cell, and the label changes where the difference of two becomes
// negative. Labels may also change at the face of a cell, where a region ends that owns no corner of
// the next cell. All code reads the compact blocks of levelset::SegmentedData.
//
// Sheets have one region on both sides. A ray meets a triangle of a sheet where its label is that of
// the sheet's region. So a sheet ends exactly where the label changes.

CONST_INT kUnknown = -1;  // label of a ray that has not started
CONST_INT kGoing = 0;
CONST_INT kEnded = 1;
CONST_INT kCrossed = 2;
CONST_INT kBlockWords = 8;  // words of levelset::SegmentedBlock
CONST_INT kMaskWords = 16;  // words of the mask of a block: cells whose corners have several labels
// Halvings of the part of a ray in a cell. A closer pair of crossings touches the interface within
// rounding.
CONST_INT kMostHalvings = 24;
CONST_INT kMostChanges = 16;  // of the label in a cell
CONST_INT kMostRefinements = 60;
CONST_DOUBLE kSliverSquare = 1e-12;  // SheetSurface::kSliver², voxels⁴

// A ray, and its crossing with an interface. Distances are in world units.
struct CrossingRay {
  double fromX, fromY, fromZ;  // position at the distance 0
  double stepX, stepY, stepZ;  // its derivative by the distance
  double t, end;               // start of the present cell or block, or the crossing; end of the ray
  int x, y, z;                 // cell
  int label;                   // region at t
  int checks;                  // 1: the next cell is asked for the label at its face
  int state;
  int front, behind;  // labels on both sides of the crossing; equal at a sheet
  double begin;       // distance beyond which sheets are seen
  SheetHit sheet;     // at the crossing; its triangle is negative at an interface
  // Gradients of the excess of `behind` less that of `front`, by the grid: of the interpolant, and
  // of the interpolated central differences. Both point to the front.
  double facetX, facetY, facetZ, smoothX, smoothY, smoothZ;
};

// A grid point.
struct RegionPoint {
  int label;
  int neighbour;    // region across the nearest interface; the same label far from it
  int block;        // number of the block; negative: none
  int voxel;        // number of the point in the block
  double distance;  // to the nearest interface
};

// Corners of a cell, numbered as CellCorners, and their different labels.
struct RegionCell {
  int label[8];
  int neighbour[8];
  int block[8];
  int voxel[8];
  double distance[8];
  int found[8];
  int count;
};

struct Cubic {  // Bernstein coefficients
  double b0, b1, b2, b3;
};

// First entry of a block in the table of blocks; negative: −1 − label of a group of 8³ blocks.
int entryOf(int x, int y, int z) {
  int group = groupEntry(((x >> 6) * groupsY + (y >> 6)) * groupsZ + (z >> 6));
  int local = ((((x >> 3) & 7) << 6) | (((y >> 3) & 7) << 3)) | ((z >> 3) & 7);
  return group < 0 ? group : group + 2 * local;
}

int voxelOf(int x, int y, int z) { return (((x & 7) << 6) | ((y & 7) << 3)) | (z & 7); }

// Label of the palette of a block. @param first  the 64-bit word at which the codes begin
int codedLabel(int block, int first, int index) {
  uint form = blockWord(kBlockWords * block + 7);
  int bits = int(form >> 16u);
  int at = index * bits;
  int start = 2 * (int(blockWord(kBlockWords * block + 3)) + first);
  uint code = (wordAt(start + (at >> 5)) >> uint(at & 31)) & ((1u << uint(bits)) - 1u);
  return paletteLabel(int(blockWord(kBlockWords * block + 6)) + int(code));
}

// Number of the distance of a voxel among those of its block; −1 for an inactive one.
int rankOf(int block, int voxel) {
  int start = 2 * int(blockWord(kBlockWords * block + 3));
  int word = voxel >> 6;
  int bit = voxel & 63;
  uint low = wordAt(start + 2 * word);
  uint own = bit < 32 ? low : wordAt(start + 2 * word + 1);
  uint place = 1u << uint(bit & 31);
  if ((own & place) == 0u) return -1;
  int rank = bitsIn(own & (place - 1u)) + (bit < 32 ? 0 : bitsIn(low));
  if (word == 0) return rank;
  int shift = 9 * (word - 1);
  uint first = wordAt(start + 16);
  uint second = wordAt(start + 17);
  uint before = shift >= 32  ? second >> uint(shift - 32)
                : shift > 23 ? (first >> uint(shift)) | (second << uint(32 - shift))
                             : first >> uint(shift);
  return rank + int(before & 511u);
}

RegionPoint regionPoint(int x, int y, int z) {
  RegionPoint point;
  int entry = entryOf(x, y, z);
  point.block = entry < 0 ? entry : tableEntry(entry);
  point.voxel = voxelOf(x, y, z);
  point.distance = background;
  point.label = -1 - point.block;
  point.neighbour = point.label;
  if (point.block < 0) return point;
  point.label = codedLabel(point.block, 9, point.voxel);
  point.neighbour = point.label;
  int rank = rankOf(point.block, point.voxel);
  if (rank < 0) return point;
  point.distance = distanceAt(int(blockWord(kBlockWords * point.block + 4)) + rank);
  uint form = blockWord(kBlockWords * point.block + 7);
  int labels = int(form & 65535u);
  int bits = int(form >> 16u);
  if (labels == 2) {
    int first = int(blockWord(kBlockWords * point.block + 6));
    int low = paletteLabel(first);
    point.neighbour = low == point.label ? paletteLabel(first + 1) : low;
  } else {
    point.neighbour = codedLabel(point.block, 9 + 8 * bits, rank);
  }
  return point;
}

int labelAt(int x, int y, int z) {
  int entry = entryOf(x, y, z);
  int block = entry < 0 ? entry : tableEntry(entry);
  return block < 0 ? -1 - block : codedLabel(block, 9, voxelOf(x, y, z));
}

// Distance of a voxel to the interface with a region that is not its nearest neighbour.
double extraDistance(int block, int voxel, int label, INOUT(int) steps) {
  if (block < 0) return background;
  int low = int(blockWord(kBlockWords * block + 5));
  int end = int(blockWord(kBlockWords * (block + 1) + 5));
  int high = end;
  uint key = (uint(voxel) << 16u) | uint(label);
  while (low < high) {
    ++steps;
    int middle = (low + high) >> 1;
    uint word = extraKey(middle);
    if (((word << 16u) | (word >> 16u)) < key)
      low = middle + 1;
    else
      high = middle;
  }
  if (low >= end) return background;
  uint word = extraKey(low);
  return ((word << 16u) | (word >> 16u)) == key ? extraValue(low) : background;
}

double excessAt(IN(RegionPoint) point, int label, INOUT(int) steps) {
  if (point.label == label) return 0.0;
  if (point.neighbour == label) return point.distance;
  return extraDistance(point.block, point.voxel, label, steps);
}

void addCorner(INOUT(RegionCell) cell, int corner, IN(RegionPoint) point) {
  cell.label[corner] = point.label;
  cell.neighbour[corner] = point.neighbour;
  cell.block[corner] = point.block;
  cell.voxel[corner] = point.voxel;
  cell.distance[corner] = point.distance;
  bool isNew = true;
  for (int n = 0; n < cell.count; ++n) isNew = isNew && cell.found[n] != point.label;
  if (isNew) {
    cell.found[cell.count] = point.label;
    cell.count = cell.count + 1;
  }
}

RegionCell regionCell(int x, int y, int z, INOUT(int) steps) {
  RegionCell cell;
  cell.count = 0;
  for (int c = 0; c < 8; ++c)
    addCorner(cell, c, regionPoint(x + (c >> 2), y + ((c >> 1) & 1), z + (c & 1)));
  steps += 8 * (cell.count + 1);
  return cell;
}

double cornerExcess(IN(RegionCell) cell, int corner, int label, INOUT(int) steps) {
  if (cell.label[corner] == label) return 0.0;
  if (cell.neighbour[corner] == label) return cell.distance[corner];
  return extraDistance(cell.block[corner], cell.voxel[corner], label, steps);
}

// In loops, not once for each corner, because drivers take long to compile long shaders.
CellCorners excessOf(IN(RegionCell) cell, int label, INOUT(int) steps) {
  double value[8];
  for (int c = 0; c < 8; ++c) value[c] = cornerExcess(cell, c, label, steps);
  steps += 8;
  CellCorners f;
  f.f0 = value[0];
  f.f1 = value[1];
  f.f2 = value[2];
  f.f3 = value[3];
  f.f4 = value[4];
  f.f5 = value[5];
  f.f6 = value[6];
  f.f7 = value[7];
  return f;
}

// Part of a cubic between two parameters: values of its blossom.
double cubicBlossom(IN(Cubic) c, double r, double s, double t) {
  double low = along(along(c.b0, c.b1, r), along(c.b1, c.b2, r), s);
  double high = along(along(c.b1, c.b2, r), along(c.b2, c.b3, r), s);
  return along(low, high, t);
}

Cubic partOf(IN(Cubic) c, double low, double high) {
  Cubic part;
  part.b0 = cubicBlossom(c, low, low, low);
  part.b1 = cubicBlossom(c, low, low, high);
  part.b2 = cubicBlossom(c, low, high, high);
  part.b3 = cubicBlossom(c, high, high, high);
  return part;
}

bool staysAbove(IN(Cubic) c) { return c.b0 >= 0.0 && c.b1 >= 0.0 && c.b2 >= 0.0 && c.b3 >= 0.0; }

// Zero of a cubic that is at least 0 at its start, negative at its end and has one crossing: secants
// with halved weights of an end that stays (the Illinois method).
double zeroIn(IN(Cubic) c, INOUT(int) steps) {
  double low = 0.0;
  double high = 1.0;
  double atLow = c.b0;
  double atHigh = c.b3;
  double last = 2.0;
  int side = 0;
  bool isDone = !(atLow > 0.0);
  double found = 0.0;
  int n = 0;
  while (!isDone && n < kMostRefinements) {
    ++n;
    ++steps;
    VAR place = low + (high - low) * (atLow / (atLow - atHigh));
    found = held(place, low, high);
    double value = cubicAt(c.b0, c.b1, c.b2, c.b3, found);
    VAR moved = found - last;
    isDone = value == 0.0 || magnitude(moved) < 1e-14;
    last = found;
    if (value >= 0.0) {
      low = found;
      atLow = value;
      VAR weighed = 0.5 * atHigh;
      atHigh = side > 0 ? weighed : atHigh;
      side = 1;
    } else {
      high = found;
      atHigh = value;
      VAR weighed = 0.5 * atLow;
      atLow = side < 0 ? weighed : atLow;
      side = -1;
    }
  }
  return found;
}

// First parameter in [0, 1] at which a cubic becomes negative; 2: it does not. The Bernstein
// coefficients bound it on each part of the interval, and parts are halved until they have one
// crossing or none.
double firstBelow(IN(Cubic) c, INOUT(int) steps) {
  if (staysAbove(c)) return 2.0;
  double low = 0.0;
  double size = 1.0;
  int depth = 0;
  int index = 0;
  while (low < 1.0) {
    ++steps;
    VAR high = low + size;
    Cubic part = partOf(c, low, high);
    if (part.b0 < 0.0) return low;
    bool isClear = staysAbove(part);
    bool isSingle = part.b3 < 0.0 && !(part.b1 < 0.0 && part.b2 >= 0.0);
    if (isSingle || (part.b3 < 0.0 && depth >= kMostHalvings)) {
      VAR found = low + size * zeroIn(part, steps);
      return found;
    }
    if (isClear || depth >= kMostHalvings) {
      low = high;
      ++index;
      while (depth > 0 && (index & 1) == 0) {
        ++steps;
        index = index >> 1;
        --depth;
        size = size * 2.0;
      }
    } else {
      size = size * 0.5;
      ++depth;
      index = index * 2;
    }
  }
  return 2.0;
}

bool isSurface(int front, int behind) {
  return front != behind && (isShown(front) || isShown(behind));
}

// Derivative of the trilinear interpolant along x, for corners that are ordered accordingly.
double slopeOf(double f0, double f1, double f2, double f3, double f4, double f5, double f6, double f7,
               double y, double z) {
  VAR d0 = f4 - f0;
  VAR d1 = f5 - f1;
  VAR d2 = f6 - f2;
  VAR d3 = f7 - f3;
  return along(along(d0, d2, y), along(d1, d3, y), z);
}

// Difference of the excesses at a grid point. @param sides  1 if the point belongs to one of the two
// regions, else 0. Points of a third region do not tell where the interface of the two goes on.
double differenceAt(int x, int y, int z, int front, int behind, INOUT(int) sides,
                    INOUT(int) steps) {
  RegionPoint point = regionPoint(x, y, z);
  sides = point.label == front || point.label == behind ? 1 : 0;
  VAR value = excessAt(point, behind, steps) - excessAt(point, front, steps);
  return value;
}

// Difference quotient of three values in a row, of which some are known.
double quotientOf(double low, double middle, double high, int hasLow, int hasHigh) {
  VAR both = 0.5 * (high - low);
  VAR up = high - middle;
  VAR down = middle - low;
  return hasLow + hasHigh == 2 ? both : (hasHigh == 1 ? up : (hasLow == 1 ? down : 0.0));
}

// Adds the gradient at one corner of the cell, by central differences, or one-sided ones beside a
// third region.
void addSmooth(INOUT(CrossingRay) ray, int x, int y, int z, double weight, INOUT(int) steps) {
  double value[7];  // of the corner, and of its neighbours before and behind it on each axis
  int sides[7];
  for (int n = 0; n < 7; ++n) {
    int axis = (n - 1) >> 1;
    int move = n == 0 ? 0 : ((n & 1) == 1 ? -1 : 1);
    int own = 0;
    value[n] = differenceAt(x + (axis == 0 ? move : 0), y + (axis == 1 ? move : 0),
                            z + (axis == 2 ? move : 0), ray.front, ray.behind, own, steps);
    sides[n] = own;
  }
  steps += 8;
  if (sides[0] == 0) return;
  VAR sumX = ray.smoothX + weight * quotientOf(value[1], value[0], value[2], sides[1], sides[2]);
  VAR sumY = ray.smoothY + weight * quotientOf(value[3], value[0], value[4], sides[3], sides[4]);
  VAR sumZ = ray.smoothZ + weight * quotientOf(value[5], value[0], value[6], sides[5], sides[6]);
  ray.smoothX = sumX;
  ray.smoothY = sumY;
  ray.smoothZ = sumZ;
}

// Takes the normals of a sheet as gradients, on the side from which the ray comes. On a sliver, whose
// own normal rounding decides on, the normal of the smooth sheet replaces it.
void addSheetNormals(INOUT(CrossingRay) ray) {
  double x = sheetFacet(ray.sheet.triangle, 0);
  double y = sheetFacet(ray.sheet.triangle, 1);
  double z = sheetFacet(ray.sheet.triangle, 2);
  double u = sheetSmooth(ray.sheet, 0);
  double v = sheetSmooth(ray.sheet, 1);
  double w = sheetSmooth(ray.sheet, 2);
  VAR square = x * x + y * y + z * z;
  bool isSliver = square < kSliverSquare;
  double facetX = isSliver ? u : x;
  double facetY = isSliver ? v : y;
  double facetZ = isSliver ? w : z;
  VAR product = facetX * ray.stepX + facetY * ray.stepY + facetZ * ray.stepZ;
  double facetSide = product > 0.0 ? -1.0 : 1.0;
  // The smooth normal lies on the same side of the sheet.
  VAR match = facetX * u + facetY * v + facetZ * w;
  double smoothSide = match < 0.0 ? 0.0 - facetSide : facetSide;
  ray.facetX = facetSide * facetX;
  ray.facetY = facetSide * facetY;
  ray.facetZ = facetSide * facetZ;
  ray.smoothX = smoothSide * u;
  ray.smoothY = smoothSide * v;
  ray.smoothZ = smoothSide * w;
}

// Computes the gradients at the crossing.
void addGradients(INOUT(CrossingRay) ray, INOUT(int) steps) {
  if (hasSheets && ray.sheet.triangle >= 0) {
    addSheetNormals(ray);
    return;
  }
  RegionCell cell = regionCell(ray.x, ray.y, ray.z, steps);
  CellCorners a = excessOf(cell, ray.behind, steps);
  CellCorners b = excessOf(cell, ray.front, steps);
  VAR f0 = a.f0 - b.f0;
  VAR f1 = a.f1 - b.f1;
  VAR f2 = a.f2 - b.f2;
  VAR f3 = a.f3 - b.f3;
  VAR f4 = a.f4 - b.f4;
  VAR f5 = a.f5 - b.f5;
  VAR f6 = a.f6 - b.f6;
  VAR f7 = a.f7 - b.f7;
  double u = inCell(ray.fromX, ray.stepX, ray.t, ray.x);
  double v = inCell(ray.fromY, ray.stepY, ray.t, ray.y);
  double w = inCell(ray.fromZ, ray.stepZ, ray.t, ray.z);
  ray.facetX = slopeOf(f0, f1, f2, f3, f4, f5, f6, f7, v, w);
  ray.facetY = slopeOf(f0, f1, f4, f5, f2, f3, f6, f7, u, w);
  ray.facetZ = slopeOf(f0, f4, f2, f6, f1, f5, f3, f7, v, u);
  for (int c = 0; c < 8; ++c) {
    VAR weightX = (c >> 2) > 0 ? u : 1.0 - u;
    VAR weightY = ((c >> 1) & 1) > 0 ? v : 1.0 - v;
    VAR weightZ = (c & 1) > 0 ? w : 1.0 - w;
    VAR weight = weightX * weightY * weightZ;
    if (weight > 0.0)
      addSmooth(ray, ray.x + (c >> 2), ray.y + ((c >> 1) & 1), ray.z + (c & 1), weight, steps);
  }
  steps += 16;
}

// Ends a ray at a crossing if a surface is there. @return true if it does
bool meet(INOUT(CrossingRay) ray, int label, double t) {
  int front = ray.label;
  ray.label = label;
  if (front == kUnknown || !isSurface(front, label)) return false;
  ray.state = kCrossed;
  ray.t = t;
  ray.front = front;
  ray.behind = label;
  return true;
}

// Ends a ray at the first sheet of its region between two distances. @return true if there is one
bool meetSheet(INOUT(CrossingRay) ray, int list, double low, double high, INOUT(int) steps) {
  ray.sheet = firstSheet(ray.fromX, ray.fromY, ray.fromZ, ray.stepX, ray.stepY, ray.stepZ, list,
                         ray.label, low, high, ray.begin, steps);
  if (ray.sheet.triangle < 0) return false;
  ray.state = kCrossed;
  ray.t = ray.sheet.t;
  ray.front = ray.label;
  ray.behind = ray.label;
  return true;
}

// Searches the part of a ray in a cell, from ray.t to `exit`. The corners have several labels, or the
// cell has sheets. @param list  of the sheets in the cell; negative: none
void searchCell(INOUT(CrossingRay) ray, double exit, int list, INOUT(int) steps) {
  RegionCell cell = regionCell(ray.x, ray.y, ray.z, steps);
  double x0 = inCell(ray.fromX, ray.stepX, ray.t, ray.x);
  double y0 = inCell(ray.fromY, ray.stepY, ray.t, ray.y);
  double z0 = inCell(ray.fromZ, ray.stepZ, ray.t, ray.z);
  double x1 = inCell(ray.fromX, ray.stepX, exit, ray.x);
  double y1 = inCell(ray.fromY, ray.stepY, exit, ray.y);
  double z1 = inCell(ray.fromZ, ray.stepZ, exit, ray.z);
  Cubic excess[8];
  int present = -1;  // number of the label of the ray in cell.found
  int least = 0;
  for (int n = 0; n < cell.count; ++n) {
    CellCorners f = excessOf(cell, cell.found[n], steps);
    Cubic c;
    c.b0 = blossomAt(f, x0, y0, z0);
    c.b1 = third(blossomAt(f, x1, y0, z0), blossomAt(f, x0, y1, z0), blossomAt(f, x0, y0, z1));
    c.b2 = third(blossomAt(f, x1, y1, z0), blossomAt(f, x1, y0, z1), blossomAt(f, x0, y1, z1));
    c.b3 = blossomAt(f, x1, y1, z1);
    excess[n] = c;
    bool isLess = c.b0 < excess[least].b0 ||
                  (c.b0 == excess[least].b0 && cell.found[n] > cell.found[least]);
    least = isLess ? n : least;
    present = cell.found[n] == ray.label ? n : present;
  }
  steps += cell.count;
  bool isKept = present >= 0 && (ray.checks == 0 || excess[present].b0 == excess[least].b0);
  if (!isKept) {
    present = least;
    if (meet(ray, cell.found[least], ray.t)) return;
  }
  double from = 0.0;
  double reached = ray.t;
  for (int change = 0; change < kMostChanges && from < 1.0; ++change) {
    double first = 2.0;
    int next = present;
    for (int n = 0; n < cell.count; ++n) {
      if (n == present) continue;
      Cubic c;
      VAR d0 = excess[n].b0 - excess[present].b0;
      VAR d1 = excess[n].b1 - excess[present].b1;
      VAR d2 = excess[n].b2 - excess[present].b2;
      VAR d3 = excess[n].b3 - excess[present].b3;
      c.b0 = d0;
      c.b1 = d1;
      c.b2 = d2;
      c.b3 = d3;
      Cubic rest = c;
      if (from > 0.0) rest = partOf(c, from, 1.0);
      rest.b0 = greater(rest.b0, 0.0);  // the present label holds up to here
      double at = firstBelow(rest, steps);
      if (at < first) {
        first = at;
        next = n;
      }
    }
    steps += cell.count + 1;
    VAR share = from + (1.0 - from) * first;
    VAR t = ray.t + (exit - ray.t) * share;
    if (list >= 0 && meetSheet(ray, list, reached, first > 1.0 ? exit : t, steps)) return;
    if (first > 1.0) break;
    reached = t;
    present = next;
    from = share;
    if (meet(ray, cell.found[next], t)) return;
  }
}

// Follows a ray until it crosses a surface or ends. If more than `mostSteps` iterations of loops are
// needed, ray.state is kGoing afterwards, and the next call goes on.
void followInterfaces(INOUT(CrossingRay) ray, int mostSteps) {
  VAR perX = 1.0 / (ray.stepX == 0.0 ? 1.0 : ray.stepX);
  VAR perY = 1.0 / (ray.stepY == 0.0 ? 1.0 : ray.stepY);
  VAR perZ = 1.0 / (ray.stepZ == 0.0 ? 1.0 : ray.stepZ);
  int steps = 0;
  while (ray.state == kGoing && steps < mostSteps) {
    ++steps;
    int entry = entryOf(ray.x, ray.y, ray.z);
    int mask = entry < 0 ? -1 : tableEntry(entry + 1);
    int size = entry < 0 ? 64 : (mask < 0 ? 8 : 1);
    int voxel = voxelOf(ray.x, ray.y, ray.z);
    bool isMixed =
        mask >= 0 && ((maskWord(kMaskWords * mask + (voxel >> 5)) >> uint(voxel & 31)) & 1u) != 0u;
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
    if (isMixed)
      searchCell(ray, exit, hasSheets ? sheetListOf(mask, voxel) : -1, steps);
    else if (ray.checks != 0) {
      int label = labelAt(ray.x, ray.y, ray.z);
      if (label != ray.label) meet(ray, label, ray.t);
    }
    if (ray.state == kGoing) {
      // Two cells of one label each have the same one, so it is asked after a mixed cell only.
      ray.checks = isMixed ? 1 : 0;
      int x = nextCell(ray.x, lowX, size, 0, across, ray.fromX, ray.stepX, perX, exit);
      int y = nextCell(ray.y, lowY, size, 1, across, ray.fromY, ray.stepY, perY, exit);
      int z = nextCell(ray.z, lowZ, size, 2, across, ray.fromZ, ray.stepZ, perZ, exit);
      bool isOut = across == 3 || x < 1 || y < 1 || z < 1 || x > pointsX - 3 || y > pointsY - 3 ||
                   z > pointsZ - 3;
      ray.t = exit;
      ray.x = isOut ? ray.x : x;
      ray.y = isOut ? ray.y : y;
      ray.z = isOut ? ray.z : z;
      ray.state = isOut || !(exit < ray.end) ? kEnded : kGoing;
    }
  }
  if (ray.state == kCrossed && wantsGradients) addGradients(ray, steps);
}

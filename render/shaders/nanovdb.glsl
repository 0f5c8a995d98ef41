// Look-up of cells and values in a NanoVDB grid. It replaces bricks.glsl, and the pictures from
// bricks must have the same bits as those from it. GLSL only, not C++. Coordinates are those of
// roots.glsl: table space, in voxels. Positions in the grid's memory are indices of 32-bit words.
//
// The grid is followed by eight background values for outside and eight for inside. They stand for
// the values of blocks without a leaf.

struct Spot {
  bool crosses;  // the surface crosses the cell
  int size;      // edge, in cells, of an aligned cube around the cell that has no crossed cell; 1 if unknown
  int brick;     // not used with NanoVDB
};

struct CellValues {
  float f0, f1, f2, f3, f4, f5, f6, f7;
};

// Position of a node's child. The two words at `place` hold the distance of the child from `node`,
// in bytes.
int childAt(int node, int place) {
  return node + (((loadHeld(place) >> 2) & 0x3fffffff) | loadHeld(place + 1) << 30);
}

bool isOnAt(int mask, int n) { return ((loadHeld(mask + (n >> 5)) >> (n & 31)) & 1) != 0; }

int farRow(float value) { return value < 0.0 ? nanoFar + 8 : nanoFar; }

// Returns the position of the first value of the block that contains the grid point (x, y, z).
// `strides` receives the packed strides of the block's values; 0 for a block without a leaf.
int blockOf(bool asked, int x, int y, int z, inout int strides) {
  strides = 0;
  int i = x + nanoOriginX, j = y + nanoOriginY, k = z + nanoOriginZ;
  int keyHigh = ((i >> 12) & 0xfffff) << 10 | ((j >> 23) & 0x1ff);
  int keyLow = ((k >> 12) & 0xfffff) | (j >> 12) << 21;
  int upper = 0;
  float tile = 0.0;
  for (int n = 0; n < nanoTiles; ++n) {
    int at = nanoRoot + kRootWords + n * kTileWords;
    if (loadHeld(at) != keyLow || loadHeld(at + 1) != keyHigh) continue;
    int child = childAt(nanoRoot, at + kTileChild);
    if (child != nanoRoot) upper = child;
    tile = loadValue(at + kTileValue);
  }
  if (upper == 0) return farRow(tile);
  int n = ((i >> 7) & 31) << 10 | ((j >> 7) & 31) << 5 | ((k >> 7) & 31);
  int place = upper + kUpperTable + 2 * n;
  if (!isOnAt(upper + kUpperMask, n)) return farRow(loadValue(place));
  int lower = childAt(upper, place);
  n = ((i >> 3) & 15) << 8 | ((j >> 3) & 15) << 4 | ((k >> 3) & 15);
  place = lower + kLowerTable + 2 * n;
  if (!isOnAt(lower + kLowerMask, n)) return farRow(loadValue(place));
  strides = 64 << kStrideShift | 8;
  return childAt(lower, place) + kLeafValues;
}

float nanoValue(int x, int y, int z) {
  int strides;
  int first = blockOf(true, x, y, z, strides);
  int inBlock = (x & 7) * (strides >> kStrideShift) + (y & 7) * (strides & ((1 << kStrideShift) - 1));
  return loadValue(first + inBlock + (z & 7));
}

// @param first, strides  position and strides of the block that contains the cell's lowest corner
CellValues cellValuesIn(int first, int strides, int x, int y, int z) {
  CellValues f;
  if (strides != 0 && (x & 7) < 7 && (y & 7) < 7 && (z & 7) < 7) {  // all corners of the cell lie in that block
    int at = first + ((x & 7) << 6 | (y & 7) << 3 | (z & 7));
    f.f0 = loadValue(at);
    f.f1 = loadValue(at + 1);
    f.f2 = loadValue(at + 8);
    f.f3 = loadValue(at + 9);
    f.f4 = loadValue(at + 64);
    f.f5 = loadValue(at + 65);
    f.f6 = loadValue(at + 72);
    f.f7 = loadValue(at + 73);
    return f;
  }
  f.f0 = nanoValue(x, y, z);
  f.f1 = nanoValue(x, y, z + 1);
  f.f2 = nanoValue(x, y + 1, z);
  f.f3 = nanoValue(x, y + 1, z + 1);
  f.f4 = nanoValue(x + 1, y, z);
  f.f5 = nanoValue(x + 1, y, z + 1);
  f.f6 = nanoValue(x + 1, y + 1, z);
  f.f7 = nanoValue(x + 1, y + 1, z + 1);
  return f;
}

CellValues cellValues(bool asked, int brick, int x, int y, int z) {
  int strides;
  int first = blockOf(true, x, y, z, strides);
  return cellValuesIn(first, strides, x, y, z);
}

Spot spotAt(bool walking, int x, int y, int z) {
  Spot spot;
  spot.brick = 0;
  spot.crosses = false;
  spot.size = 1;
  int strides;
  int first = blockOf(true, x, y, z, strides);
  bool anyLeaf = strides != 0;
  for (int n = 1; n < 8; ++n) {  // blocks after this one along x, y, z, which hold corners of its last cells
    if (anyLeaf) break;
    int beside;
    blockOf(true, x + 8 * (n >> 2), y + 8 * ((n >> 1) & 1), z + 8 * (n & 1), beside);
    anyLeaf = beside != 0;
  }
  if (!anyLeaf) {
    spot.size = 8;
    return spot;
  }
  CellValues f = cellValuesIn(first, strides, x, y, z);
  bool allIn = f.f0 < 0.0 && f.f1 < 0.0 && f.f2 < 0.0 && f.f3 < 0.0 && f.f4 < 0.0 && f.f5 < 0.0 &&
               f.f6 < 0.0 && f.f7 < 0.0;
  bool anyIn = f.f0 < 0.0 || f.f1 < 0.0 || f.f2 < 0.0 || f.f3 < 0.0 || f.f4 < 0.0 || f.f5 < 0.0 ||
               f.f6 < 0.0 || f.f7 < 0.0;
  spot.crosses = anyIn && !allIn;
  return spot;
}

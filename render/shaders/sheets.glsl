// Sheets of a segmented field along a ray: triangles, listed by cell. The code is valid GLSL and C++,
// in double precision, follows grid_walk.glsl and precedes interfaces.glsl.
//
// A ray is sheared so that it runs along the third axis [Woop13]. Then the signs of three products
// tell if it passes through a triangle. Two triangles that share an edge compute the same product
// for it, up to the sign. So no ray slips through between them.

CONST_INT kSheetWords = 32;  // of a mask: cells with sheets, numbers of their first lists

// First triangle that a ray meets.
struct SheetHit {
  int triangle;  // −1: none
  double t;
  double shareA, shareB, shareC;  // of the corners in the position
};

// A triangle's corner in the sheared space of a ray.
struct ShearedPoint {
  double x, y, z;
};

// A ray's shear. The axes are turned so that the direction is longest along the third one.
struct Shear {
  int first, second, third;
  double shiftX, shiftY, scale;
};

double pick(double x, double y, double z, int axis) { return axis == 0 ? x : (axis == 1 ? y : z); }

Shear shearOf(double stepX, double stepY, double stepZ) {
  Shear shear;
  double x = magnitude(stepX);
  double y = magnitude(stepY);
  double z = magnitude(stepZ);
  shear.third = x >= y && x >= z ? 0 : (y >= z ? 1 : 2);
  shear.first = shear.third == 2 ? 0 : shear.third + 1;
  shear.second = shear.first == 2 ? 0 : shear.first + 1;
  double longest = pick(stepX, stepY, stepZ, shear.third);
  VAR shiftX = pick(stepX, stepY, stepZ, shear.first) / longest;
  VAR shiftY = pick(stepX, stepY, stepZ, shear.second) / longest;
  VAR scale = 1.0 / longest;
  shear.shiftX = shiftX;
  shear.shiftY = shiftY;
  shear.scale = scale;
  return shear;
}

ShearedPoint shearedPoint(IN(Shear) shear, int vertex, double fromX, double fromY, double fromZ) {
  VAR x = sheetVertex(3 * vertex) - fromX;
  VAR y = sheetVertex(3 * vertex + 1) - fromY;
  VAR z = sheetVertex(3 * vertex + 2) - fromZ;
  double depth = pick(x, y, z, shear.third);
  VAR across = pick(x, y, z, shear.first) - shear.shiftX * depth;
  VAR down = pick(x, y, z, shear.second) - shear.shiftY * depth;
  VAR distant = shear.scale * depth;
  ShearedPoint point;
  point.x = across;
  point.y = down;
  point.z = distant;
  return point;
}

// Twice the area between the ray and two points. With swapped points it changes its sign, exactly.
double between(IN(ShearedPoint) a, IN(ShearedPoint) b) {
  VAR area = b.x * a.y - b.y * a.x;
  return area;
}

// List of the triangles in a cell; −1: none. @param mask  number of the mask of its block
int sheetListOf(int mask, int voxel) {
  uint cells = sheetCellWord(kSheetWords * mask + (voxel >> 5));
  uint place = 1u << uint(voxel & 31);
  if ((cells & place) == 0u) return -1;
  return int(sheetCellWord(kSheetWords * mask + 16 + (voxel >> 5))) + bitsIn(cells & (place - 1u));
}

// First triangle of a region in a list at a distance in [low, high] that is more than `begin`.
SheetHit firstSheet(double fromX, double fromY, double fromZ, double stepX, double stepY, double stepZ,
                    int list, int label, double low, double high, double begin,
                    INOUT(int) steps) {
  SheetHit hit;
  hit.triangle = -1;
  hit.t = high;
  hit.shareA = 0.0;
  hit.shareB = 0.0;
  hit.shareC = 0.0;
  Shear shear = shearOf(stepX, stepY, stepZ);
  int last = sheetEntry(list + 1);
  for (int n = sheetEntry(list); n < last; ++n) {
    ++steps;
    int triangle = sheetEntry(n);
    if (sheetCorner(4 * triangle + 3) != label) continue;
    ShearedPoint a = shearedPoint(shear, sheetCorner(4 * triangle), fromX, fromY, fromZ);
    ShearedPoint b = shearedPoint(shear, sheetCorner(4 * triangle + 1), fromX, fromY, fromZ);
    ShearedPoint c = shearedPoint(shear, sheetCorner(4 * triangle + 2), fromX, fromY, fromZ);
    double u = between(b, c);
    double v = between(c, a);
    double w = between(a, b);
    bool isBelow = u < 0.0 || v < 0.0 || w < 0.0;
    bool isAbove = u > 0.0 || v > 0.0 || w > 0.0;
    VAR sum = u + v + w;
    if ((isBelow && isAbove) || sum == 0.0) continue;
    VAR t = (u * a.z + v * b.z + w * c.z) / sum;
    bool isNearest = hit.triangle < 0 ? t <= hit.t : t < hit.t;
    if (!isNearest || t < low || t <= begin) continue;
    VAR shareA = u / sum;
    VAR shareB = v / sum;
    VAR shareC = w / sum;
    hit.triangle = triangle;
    hit.t = t;
    hit.shareA = shareA;
    hit.shareB = shareB;
    hit.shareC = shareC;
  }
  return hit;
}

// Normal of a sheet's triangle, as a sum of components. @param axis  of the component
double sheetFacet(int triangle, int axis) {
  int a = 3 * sheetCorner(4 * triangle);
  int b = 3 * sheetCorner(4 * triangle + 1);
  int c = 3 * sheetCorner(4 * triangle + 2);
  int i = axis == 2 ? 0 : axis + 1;
  int j = i == 2 ? 0 : i + 1;
  VAR normal = (sheetVertex(b + i) - sheetVertex(a + i)) * (sheetVertex(c + j) - sheetVertex(a + j)) -
               (sheetVertex(b + j) - sheetVertex(a + j)) * (sheetVertex(c + i) - sheetVertex(a + i));
  return normal;
}

double sheetSmooth(IN(SheetHit) hit, int axis) {
  int first = 9 * hit.triangle + axis;
  VAR normal = hit.shareA * sheetNormal(first) + hit.shareB * sheetNormal(first + 3) +
               hit.shareC * sheetNormal(first + 6);
  return normal;
}

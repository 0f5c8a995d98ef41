// The first crossing of a ray with the zero set of a grid of bricks, written once for GLSL and C++.
//
// C++ includes this text into a class whose Real, Whole and Bool are vectors of lanes, and whose
// members are the grid's tables; in GLSL they are float, int and bool, and uniforms. Nothing but
// sums, products and comparisons of floats decides anything, so that every processor gets the same
// bits; loads of lanes that are not at work go to place 0.
//
// Space is that of the tables: grid points at whole coordinates, the first one at 0. Cell (i, j, k)
// spans the points i … i+1, j … j+1, k … k+1. A negative value is inside, zero is outside.

CONST_INT kNone = 3;             // no axis
CONST_INT kMostHalvings = 12;    // of a cell where two crossings are looked for
CONST_INT kBisections = 20;      // of the part that holds one
CONST_FLOAT kThird = 0.33333333333f;
CONST_FLOAT kBarelyInside = -1e-30f;
CONST_FLOAT kLeastDirection = 1e-20f;
CONST_FLOAT kParallel = 1e30f;
CONST_FLOAT kBesideBox = 0.0625f;  // so that rounding loses no crossing on a face of the box

// Where a ray meets the plane of points k. The only such function: monotone in k, and the same for
// the two cells at a plane, so that no ray slips between them.
Real planeAt(Whole k, Real origin, Real inverse) {
  VAR distance = toReal(k) - origin;
  VAR t = distance * inverse;
  return t;
}

// The cell on one axis that a ray is in at t, among those from low to high.
Whole cellAt(Real t, Real origin, Real direction, Real inverse, Whole low, Whole high) {
  VAR place = origin + t * direction;
  VAR held = smaller(larger(place, toReal(low)), toReal(high));
  Whole cell = toWhole(held);  // not negative
  Bool ahead = direction >= 0.0f;
  VAR leaves = planeAt(select(ahead, cell + 1, cell), origin, inverse);
  VAR enters = planeAt(select(ahead, cell, cell + 1), origin, inverse);
  Whole onwards = select(ahead, whole(1), whole(-1));
  Whole mended = select(leaves < t, cell + onwards, select(enters > t, cell - onwards, cell));
  return smaller(larger(mended, low), high);
}

Real between(Real a, Real b, Real share, Real rest) {
  VAR sum = a * rest + b * share;  // exact at both ends, and no sign of its own
  return sum;
}

// The cubic with Bernstein coefficients b at u, v and w: its blossom.
Real blossom(Real b0, Real b1, Real b2, Real b3, Real u, Real v, Real w) {
  VAR ru = 1.0f - u;
  VAR rv = 1.0f - v;
  VAR rw = 1.0f - w;
  VAR a0 = between(b0, b1, u, ru);
  VAR a1 = between(b1, b2, u, ru);
  VAR a2 = between(b2, b3, u, ru);
  return between(between(a0, a1, v, rv), between(a1, a2, v, rv), w, rw);
}

Whole signChanges(Real b0, Real b1, Real b2, Real b3) {
  return bit(differ(b0 < 0.0f, b1 < 0.0f), 1) + bit(differ(b1 < 0.0f, b2 < 0.0f), 1) +
         bit(differ(b2 < 0.0f, b3 < 0.0f), 1);
}

// Finds the first part of [0, 1] in which the cubic changes sign once.
// @return where there is one
Bool isolate(Bool asked, Real b0, Real b1, Real b2, Real b3, INOUT(Real) low, INOUT(Real) high) {
  Whole changes = signChanges(b0, b1, b2, b3);
  Bool found = AND(asked, changes == 1);
  Bool open = AND(asked, changes > 1);
  low = real(0.0f);
  high = real(1.0f);
  // Part number `part` of those of size `size`, leftmost first; whole parts are left where a sign
  // rule proves them empty.
  Whole part = whole(0);
  Whole halvings = whole(0);
  VAR size = real(1.0f);
  while (any(open)) {
    VAR u = toReal(part) * size;
    VAR w = toReal(part + 1) * size;
    VAR c0 = blossom(b0, b1, b2, b3, u, u, u);
    VAR c1 = blossom(b0, b1, b2, b3, u, u, w);
    VAR c2 = blossom(b0, b1, b2, b3, u, w, w);
    VAR c3 = blossom(b0, b1, b2, b3, w, w, w);
    Whole count = signChanges(c0, c1, c2, c3);
    Bool deepest = halvings == kMostHalvings;
    Bool ends = AND(open, OR(count == 1, AND(deepest, differ(c0 < 0.0f, c3 < 0.0f))));
    low = select(ends, u, low);
    high = select(ends, w, high);
    found = OR(found, ends);
    open = AND(open, NOT(ends));
    Bool divide = AND(open, AND(count > 1, NOT(deepest)));
    Bool next = AND(open, NOT(divide));
    part = select(divide, part + part, select(next, part + 1, part));
    halvings = select(divide, halvings + 1, halvings);
    size = select(divide, size * 0.5f, size);
    for (int i = 0; i < kMostHalvings; ++i) {  // an even number begins a part twice as large
      Bool up = AND(next, AND((part & 1) == 0, halvings > 0));
      part = select(up, part >> 1, part);
      halvings = select(up, halvings - 1, halvings);
      size = select(up, size + size, size);
    }
    open = AND(open, OR(divide, halvings > 0));
  }
  return found;
}

// The parameter in [low, high] at which the cubic changes sign, once there.
Real bisect(Real b0, Real b1, Real b2, Real b3, Real low, Real high) {
  Bool inside = blossom(b0, b1, b2, b3, low, low, low) < 0.0f;
  for (int i = 0; i < kBisections; ++i) {
    VAR middle = (low + high) * 0.5f;
    Bool same = NOT(differ(blossom(b0, b1, b2, b3, middle, middle, middle) < 0.0f, inside));
    low = select(same, middle, low);
    high = select(same, high, middle);
  }
  return (low + high) * 0.5f;
}

// The corners of a cell's face, of which corner 4x + 2y + z is a bit.
Whole faceCorners(Whole axis, Bool upper) {
  return select(axis == 0, select(upper, whole(0xf0), whole(0x0f)),
                select(axis == 1, select(upper, whole(0xcc), whole(0x33)),
                       select(upper, whole(0xaa), whole(0x55))));
}

// A value of a side that is known: where rounding says otherwise, barely on that side.
Real onSide(Real value, Bool inside) {
  return select(differ(value < 0.0f, inside), select(inside, real(kBarelyInside), real(0.0f)),
                value);
}

struct Crossing {
  Bool found;
  Real share;    // of the way through the cell
  Bool endsInside;
};

// What a ray does between two points of a cell, given from 0 to 1 on each axis.
// @param brick, corner   the cell's values
// @param entered, left   axes of the faces, or kNone
// @param carried, inside is the side known on which the cell before ended, and is it the inside
Crossing crossingIn(Bool asked, Whole brick, Whole corner, Real x0, Real y0, Real z0, Real x1,
                    Real y1, Real z1, Whole entered, Whole left, Bool aheadX, Bool aheadY,
                    Bool aheadZ, Bool carried, Bool inside) {
  Whole first = select(asked, brick * kBrickValues + corner, whole(0));
  Real f0 = loadValue(first);
  Real f1 = loadValue(first + 1);
  Real f2 = loadValue(first + kBrickEdge);
  Real f3 = loadValue(first + (kBrickEdge + 1));
  Real f4 = loadValue(first + kBrickEdge * kBrickEdge);
  Real f5 = loadValue(first + (kBrickEdge * kBrickEdge + 1));
  Real f6 = loadValue(first + (kBrickEdge * kBrickEdge + kBrickEdge));
  Real f7 = loadValue(first + (kBrickEdge * kBrickEdge + kBrickEdge + 1));
  Whole signs = bit(f0 < 0.0f, 1) | bit(f1 < 0.0f, 2) | bit(f2 < 0.0f, 4) | bit(f3 < 0.0f, 8) |
                bit(f4 < 0.0f, 16) | bit(f5 < 0.0f, 32) | bit(f6 < 0.0f, 64) |
                bit(f7 < 0.0f, 128);

  // The trilinear interpolant along the way is a cubic; its coefficients are the blossom's values.
  VAR rx0 = 1.0f - x0;
  VAR ry0 = 1.0f - y0;
  VAR rz0 = 1.0f - z0;
  VAR rx1 = 1.0f - x1;
  VAR ry1 = 1.0f - y1;
  VAR rz1 = 1.0f - z1;
  VAR g00 = between(f0, f4, x0, rx0);
  VAR g01 = between(f1, f5, x0, rx0);
  VAR g02 = between(f2, f6, x0, rx0);
  VAR g03 = between(f3, f7, x0, rx0);
  VAR g10 = between(f0, f4, x1, rx1);
  VAR g11 = between(f1, f5, x1, rx1);
  VAR g12 = between(f2, f6, x1, rx1);
  VAR g13 = between(f3, f7, x1, rx1);
  VAR h000 = between(g00, g02, y0, ry0);
  VAR h001 = between(g01, g03, y0, ry0);
  VAR h010 = between(g00, g02, y1, ry1);
  VAR h011 = between(g01, g03, y1, ry1);
  VAR h100 = between(g10, g12, y0, ry0);
  VAR h101 = between(g11, g13, y0, ry0);
  VAR h110 = between(g10, g12, y1, ry1);
  VAR h111 = between(g11, g13, y1, ry1);
  VAR b0 = between(h000, h001, z0, rz0);
  VAR e1 = between(h000, h001, z1, rz1);
  VAR e2 = between(h010, h011, z0, rz0);
  VAR e3 = between(h100, h101, z0, rz0);
  VAR e4 = between(h010, h011, z1, rz1);
  VAR e5 = between(h100, h101, z1, rz1);
  VAR e6 = between(h110, h111, z0, rz0);
  VAR b3 = between(h110, h111, z1, rz1);
  VAR b1 = ((e1 + e2) + e3) * kThird;
  VAR b2 = ((e4 + e5) + e6) * kThird;

  // At a face between two cells there is one side, whichever of them asks: that of its corners
  // where they agree, else the one on which the cell before ended.
  Bool upperIn = select(entered == 0, NOT(aheadX), select(entered == 1, NOT(aheadY), NOT(aheadZ)));
  Bool upperOut = select(left == 0, aheadX, select(left == 1, aheadY, aheadZ));
  Whole maskIn = faceCorners(entered, upperIn);
  Whole maskOut = faceCorners(left, upperOut);
  Whole in_ = signs & maskIn;
  Whole out_ = signs & maskOut;
  Bool uniformIn = AND(entered != kNone, OR(in_ == 0, in_ == maskIn));
  Bool uniformOut = AND(left != kNone, OR(out_ == 0, out_ == maskOut));
  b0 = select(uniformIn, onSide(b0, in_ != 0), select(carried, onSide(b0, inside), b0));
  b3 = select(uniformOut, onSide(b3, out_ != 0), b3);

  Crossing crossing;
  Real low;
  Real high;
  crossing.found = isolate(asked, b0, b1, b2, b3, low, high);
  crossing.endsInside = b3 < 0.0f;
  crossing.share = real(0.0f);
  if (any(crossing.found)) crossing.share = bisect(b0, b1, b2, b3, low, high);
  return crossing;
}

struct Ray {
  Real ox, oy, oz;  // where t is 0
  Real dx, dy, dz;  // by t
  Real ix, iy, iz;  // their inverses; kParallel where they are 0
  Real start, end;  // of t
};

// Where the ray of a pixel is on an axis of a RayFan.
Real onFan(float middle, float right, float down, Real x, Real y) {
  VAR across = x * right + y * down;
  return across + middle;
}

// A ray that goes nowhere on an axis counts as going ahead and meets no plane of it: its inverse
// is kParallel, and it is not moved off the place where it is.
Real onlyFar(Real d) {
  return select(AND(d > -kLeastDirection, d < kLeastDirection), real(0.0f), d);
}

Real inverseOf(Real d) { return select(d == 0.0f, real(kParallel), 1.0f / d); }

// The ray of the pixel (x, y) of the fan, between the faces of the box of crossing cells.
Ray viewRay(Real x, Real y) {
  Ray ray;
  ray.ox = onFan(fan.origin[0], fan.originX[0], fan.originY[0], x, y);
  ray.oy = onFan(fan.origin[1], fan.originX[1], fan.originY[1], x, y);
  ray.oz = onFan(fan.origin[2], fan.originX[2], fan.originY[2], x, y);
  ray.dx = onlyFar(onFan(fan.direction[0], fan.directionX[0], fan.directionY[0], x, y));
  ray.dy = onlyFar(onFan(fan.direction[1], fan.directionX[1], fan.directionY[1], x, y));
  ray.dz = onlyFar(onFan(fan.direction[2], fan.directionX[2], fan.directionY[2], x, y));
  ray.ix = inverseOf(ray.dx);
  ray.iy = inverseOf(ray.dy);
  ray.iz = inverseOf(ray.dz);
  VAR ax = (fan.low[0] - kBesideBox - ray.ox) * ray.ix;
  VAR ay = (fan.low[1] - kBesideBox - ray.oy) * ray.iy;
  VAR az = (fan.low[2] - kBesideBox - ray.oz) * ray.iz;
  VAR bx = (fan.high[0] + kBesideBox - ray.ox) * ray.ix;
  VAR by = (fan.high[1] + kBesideBox - ray.oy) * ray.iy;
  VAR bz = (fan.high[2] + kBesideBox - ray.oz) * ray.iz;
  ray.start = larger(larger(smaller(ax, bx), smaller(ay, by)), larger(smaller(az, bz), 0.0f));
  ray.end = smaller(smaller(larger(ax, bx), larger(ay, by)), larger(az, bz));
  return ray;
}

struct Hit {
  Bool found;
  Real t;
  Whole x, y, z;  // cell
};

Hit trace(Ray ray) {
  Bool aheadX = ray.dx >= 0.0f;
  Bool aheadY = ray.dy >= 0.0f;
  Bool aheadZ = ray.dz >= 0.0f;
  Hit hit;
  hit.found = no();
  hit.t = ray.start;
  Bool alive = ray.start <= ray.end;
  VAR t = ray.start;
  Whole x = cellAt(t, ray.ox, ray.dx, ray.ix, whole(0), whole(tableSizeX - 1));
  Whole y = cellAt(t, ray.oy, ray.dy, ray.iy, whole(0), whole(tableSizeY - 1));
  Whole z = cellAt(t, ray.oz, ray.dz, ray.iz, whole(0), whole(tableSizeZ - 1));
  // A ray that starts before the table's first cells begins on their faces.
  t = larger(t, planeAt(select(aheadX, x, x + 1), ray.ox, ray.ix));
  t = larger(t, planeAt(select(aheadY, y, y + 1), ray.oy, ray.iy));
  t = larger(t, planeAt(select(aheadZ, z, z + 1), ray.oz, ray.iz));
  alive = AND(alive, t <= ray.end);
  Whole entered = whole(kNone);
  Bool solved = no();    // the cell where a lane is crosses the surface, and the ray does not there
  Bool carried = no();   // the cell before was such a one
  Bool inside = no();    // and ended there
  while (any(alive)) {
    // Walk to the next cell with a crossing.
    Bool walking = alive;
    Whole brick = whole(0);
    Whole corner = whole(0);
    Whole axis = whole(kNone);
    VAR tExit = t;
    while (many(walking, alive)) {
      Whole page = select(walking, ((x >> kPageShift) * pagesY + (y >> kPageShift)) * pagesZ + (z >> kPageShift), whole(0));
      Whole entry = loadPage(page);
      Bool full = AND(walking, entry >= 0);
      Whole slot = select(full, entry + (((x >> 3) & 7) << 6 | ((y >> 3) & 7) << 3 | ((z >> 3) & 7)), whole(0));
      Whole held = loadEntry(slot);
      entry = select(full, held, entry);
      Bool isBrick = AND(full, entry >= 0);
      Whole cell = (x & 7) << 6 | (y & 7) << 3 | (z & 7);
      Whole word = loadMask(select(isBrick, (entry << 4) + (cell >> 5), whole(0)));
      Bool stop = AND(AND(isBrick, ((word >> (cell & 31)) & 1) != 0), NOT(solved));
      Whole size = select(isBrick, whole(1), whole(0) - entry);
      Whole lowX = x & (whole(0) - size);
      Whole lowY = y & (whole(0) - size);
      Whole lowZ = z & (whole(0) - size);
      VAR tx = planeAt(select(aheadX, lowX + size, lowX), ray.ox, ray.ix);
      VAR ty = planeAt(select(aheadY, lowY + size, lowY), ray.oy, ray.iy);
      VAR tz = planeAt(select(aheadZ, lowZ + size, lowZ), ray.oz, ray.iz);
      Bool byX = AND(tx <= ty, tx <= tz);
      Bool byY = AND(NOT(byX), ty <= tz);
      Bool byZ = AND(NOT(byX), NOT(byY));
      Whole out_ = select(byX, whole(0), select(byY, whole(1), whole(2)));
      VAR leaves = larger(t, select(byX, tx, select(byY, ty, tz)));
      Bool stopping = AND(walking, stop);
      brick = select(stopping, entry, brick);
      corner = select(stopping, ((x & 7) * kBrickEdge + (y & 7)) * kBrickEdge + (z & 7), corner);
      axis = select(stopping, out_, axis);
      tExit = select(stopping, leaves, tExit);
      Bool moving = AND(walking, NOT(stop));
      t = select(moving, leaves, t);
      entered = select(moving, out_, entered);
      carried = select(moving, solved, carried);
      solved = AND(solved, NOT(moving));
      Bool leap = AND(moving, size > 1);
      Whole nextX = select(aheadX, lowX + size, lowX - 1);
      Whole nextY = select(aheadY, lowY + size, lowY - 1);
      Whole nextZ = select(aheadZ, lowZ + size, lowZ - 1);
      Whole stillX = x;
      Whole stillY = y;
      Whole stillZ = z;
      if (any(leap)) {
        stillX = select(leap, cellAt(leaves, ray.ox, ray.dx, ray.ix, lowX, lowX + (size - 1)), x);
        stillY = select(leap, cellAt(leaves, ray.oy, ray.dy, ray.iy, lowY, lowY + (size - 1)), y);
        stillZ = select(leap, cellAt(leaves, ray.oz, ray.dz, ray.iz, lowZ, lowZ + (size - 1)), z);
      }
      x = select(moving, select(byX, nextX, stillX), x);
      y = select(moving, select(byY, nextY, stillY), y);
      z = select(moving, select(byZ, nextZ, stillZ), z);
      Bool gone = OR((x | y | z | (tableSizeX - 1 - x) | (tableSizeY - 1 - y) | (tableSizeZ - 1 - z)) < 0, t > ray.end);
      alive = AND(alive, NOT(AND(moving, gone)));
      walking = AND(moving, NOT(gone));
    }
    // Those that still walk have not come to a cell yet.
    Bool asked = AND(alive, NOT(walking));
    if (any(asked)) {
      VAR fromX = ray.ox - toReal(x);
      VAR fromY = ray.oy - toReal(y);
      VAR fromZ = ray.oz - toReal(z);
      VAR inX = fromX + t * ray.dx;
      VAR x0 = smaller(larger(inX, 0.0f), 1.0f);
      VAR inY = fromY + t * ray.dy;
      VAR y0 = smaller(larger(inY, 0.0f), 1.0f);
      VAR inZ = fromZ + t * ray.dz;
      VAR z0 = smaller(larger(inZ, 0.0f), 1.0f);
      VAR outX = fromX + tExit * ray.dx;
      VAR x1 = smaller(larger(outX, 0.0f), 1.0f);
      VAR outY = fromY + tExit * ray.dy;
      VAR y1 = smaller(larger(outY, 0.0f), 1.0f);
      VAR outZ = fromZ + tExit * ray.dz;
      VAR z1 = smaller(larger(outZ, 0.0f), 1.0f);
      Crossing crossing = crossingIn(asked, brick, corner, x0, y0, z0, x1, y1, z1, entered, axis,
                                     aheadX, aheadY, aheadZ, carried, inside);
      VAR place = t + crossing.share * (tExit - t);
      Bool hits = AND(asked, AND(crossing.found, place <= ray.end));
      hit.found = OR(hit.found, hits);
      hit.t = select(hits, place, hit.t);
      solved = OR(solved, asked);
      inside = select(asked, crossing.endsInside, inside);
      alive = AND(alive, NOT(hits));
    }
  }
  hit.x = x;
  hit.y = y;
  hit.z = z;
  return hit;
}

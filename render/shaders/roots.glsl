// The kernel: finds the first crossing of a ray with the zero set of a grid of bricks. The code is
// valid GLSL and C++. This file computes where a ray meets grid planes, and isolates roots of
// polynomials by sign changes.
//
// C++ includes this text into a class. There Real, Int and Bool are vectors of lanes, and the
// tables of the grid are members. In GLSL they are float, int and bool, and uniforms. All decisions
// depend on sums, products and comparisons of floats alone, so that all processors return the same
// bits. Inactive lanes load from index 0.
//
// NUMBER(…) rounds a constant to the precision of Real: hit_refinement.cpp includes parts of this
// code with doubles.
//
// Coordinates are those of table space: grid points have integer coordinates, starting at 0. Cell
// (i, j, k) spans the points i … i+1, j … j+1, k … k+1. Negative values are inside, zero is
// outside.

CONST_INT kNone = 3;             // number that stands for no axis
CONST_INT kMostHalvings = 12;    // largest number of halvings of a ray segment in a cell with several crossings
CONST_INT kBisections = 20;      // halvings of an interval that holds one crossing
CONST_FLOAT kThird = NUMBER(1.0 / 3.0);
CONST_FLOAT kBarelyInside = -1e-30f;
CONST_FLOAT kLeastDirection = 1e-20f;
CONST_FLOAT kParallel = 1e30f;
CONST_FLOAT kBesideBox = 0.0625f;  // padding of the box of the surface's blocks, voxels, so that rounding does not lose a crossing on a face of the box

// Parameter at which a ray meets the plane of the grid points with coordinate k along one axis. All
// cells use this function. It is monotone in k, and both cells at a plane get the same number, so
// no ray slips between them.
Real planeAt(Int k, Real origin, Real inverse) {
  VAR distance = toReal(k) - origin;
  VAR t = distance * inverse;
  return t;
}

// Index along one axis of the cell that contains the ray at t, clamped to [low, high].
Int cellAt(Real t, Real origin, Real direction, Real inverse, Int low, Int high) {
  VAR place = origin + t * direction;
  VAR held = smaller(larger(place, toReal(low)), toReal(high));
  Int cell = toInt(held);  // `held` is not negative, so the conversion rounds down
  Bool ahead = direction >= 0.0f;
  VAR leaves = planeAt(select(ahead, cell + 1, cell), origin, inverse);
  VAR enters = planeAt(select(ahead, cell, cell + 1), origin, inverse);
  Int onwards = select(ahead, integer(1), integer(-1));
  Int mended = select(leaves < t, cell + onwards, select(enters > t, cell - onwards, cell));
  return smaller(larger(mended, low), high);
}

Real between(Real a, Real b, Real share, Real rest) {
  VAR sum = a * rest + b * share;  // exact at both ends; keeps the sign when a and b have equal signs
  return sum;
}

// Blossom at (u, v, w) of the cubic with Bernstein coefficients b.
Real blossom(Real b0, Real b1, Real b2, Real b3, Real u, Real v, Real w) {
  VAR ru = 1.0f - u;
  VAR rv = 1.0f - v;
  VAR rw = 1.0f - w;
  VAR a0 = between(b0, b1, u, ru);
  VAR a1 = between(b1, b2, u, ru);
  VAR a2 = between(b2, b3, u, ru);
  return between(between(a0, a1, v, rv), between(a1, a2, v, rv), w, rw);
}

Int signChanges(Real b0, Real b1, Real b2, Real b3) {
  return bit(differ(b0 < 0.0f, b1 < 0.0f), 1) + bit(differ(b1 < 0.0f, b2 < 0.0f), 1) +
         bit(differ(b2 < 0.0f, b3 < 0.0f), 1);
}

// Moves on from interval number `part` of [0, 1], which has the length `size` after `halvings`
// halvings. If `divides`, the next interval is the first half of this one. Otherwise it is the one
// that follows, with the largest length that fits. The test of that larger interval may prove it
// empty at once.
// @return true while an interval is left
Bool nextPart(Bool open, Bool divides, INOUT(Int) part, INOUT(Int) halvings, INOUT(Real) size) {
  Bool divide = AND(open, divides);
  Bool next = AND(open, NOT(divide));
  part = select(divide, part + part, select(next, part + 1, part));
  halvings = select(divide, halvings + 1, halvings);
  size = select(divide, size * 0.5f, size);
  // An interval with an even number is the first half of an interval of twice the length.
  for (int i = 0; i < kMostHalvings; ++i) {
    Bool up = AND(next, AND((part & 1) == 0, halvings > 0));
    part = select(up, part >> 1, part);
    halvings = select(up, halvings - 1, halvings);
    size = select(up, size + size, size);
  }
  return AND(open, OR(divide, halvings > 0));
}

// Finds the first interval [low, high] in [0, 1] with a single sign change of a cubic, after
// skipping `passing` sign changes. Its Bernstein coefficients are b0 … b3. Skipped changes are
// subtracted from `passing`.
// @return true when such an interval exists
Bool isolate(Bool asked, Real b0, Real b1, Real b2, Real b3, INOUT(Int) passing, INOUT(Real) low,
             INOUT(Real) high) {
  Int changes = signChanges(b0, b1, b2, b3);
  Bool single = AND(asked, changes == 1);
  Bool found = AND(single, passing == 0);
  passing = passing - bit(AND(single, NOT(found)), 1);
  Bool open = AND(asked, changes > 1);
  low = real(0.0f);
  high = real(1.0f);
  Int part = integer(0);
  Int halvings = integer(0);
  VAR size = real(1.0f);
  while (any(open)) {
    VAR u = toReal(part) * size;
    VAR w = toReal(part + 1) * size;
    VAR c0 = blossom(b0, b1, b2, b3, u, u, u);
    VAR c1 = blossom(b0, b1, b2, b3, u, u, w);
    VAR c2 = blossom(b0, b1, b2, b3, u, w, w);
    VAR c3 = blossom(b0, b1, b2, b3, w, w, w);
    Int count = signChanges(c0, c1, c2, c3);
    Bool deepest = halvings == kMostHalvings;
    Bool crosses = AND(open, OR(count == 1, AND(deepest, differ(c0 < 0.0f, c3 < 0.0f))));
    Bool ends = AND(crosses, passing == 0);
    passing = passing - bit(AND(crosses, NOT(ends)), 1);
    low = select(ends, u, low);
    high = select(ends, w, high);
    found = OR(found, ends);
    open = AND(open, NOT(ends));
    open = nextPart(open, AND(count > 1, NOT(deepest)), part, halvings, size);
  }
  return found;
}

// Finds the parameter in [low, high] at which the cubic changes sign once, by bisection.
// @param inside  true when the cubic is negative at low
Real bisect(Real b0, Real b1, Real b2, Real b3, Bool inside, Real low, Real high) {
  for (int i = 0; i < kBisections; ++i) {
    VAR middle = (low + high) * 0.5f;
    Bool same = NOT(differ(blossom(b0, b1, b2, b3, middle, middle, middle) < 0.0f, inside));
    low = select(same, middle, low);
    high = select(same, high, middle);
  }
  return (low + high) * 0.5f;
}

// Mask of the four corners on a face of a cell. The corner (x, y, z), each 0 or 1, has the bit 4x +
// 2y + z.
Int faceCorners(Int axis, Bool upper) {
  return select(axis == 0, select(upper, integer(0xf0), integer(0x0f)),
                select(axis == 1, select(upper, integer(0xcc), integer(0x33)),
                       select(upper, integer(0xaa), integer(0x55))));
}

// Corrects the sign of a value at a point that is known to be inside or outside. A value with the
// wrong sign becomes a tiny value inside, or 0 outside.
Real onSide(Real value, Bool inside) {
  return select(differ(value < 0.0f, inside), select(inside, real(kBarelyInside), real(0.0f)),
                value);
}

struct Crossing {
  Bool found;
  Real share;  // position of the crossing as a fraction of the ray's segment in the cell
  Bool enters;      // the ray enters the solid at the crossing; false: it leaves
  Bool endsInside;  // the ray's segment ends inside the solid
};

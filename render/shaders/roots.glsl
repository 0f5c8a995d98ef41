// The kernel: the first crossing of a ray with the zero set of a grid of bricks, written once for GLSL
// and C++. Here: planes, and the roots of polynomials by their signs.
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

// Goes on from part number `part` of those of size `size`, to its first half where it is divided, else
// to the next; whole parts are left where a sign rule proves them empty.
// @return where there is one
Bool resume(Bool open, Bool divides, INOUT(Whole) part, INOUT(Whole) halvings, INOUT(Real) size) {
  Bool divide = AND(open, divides);
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
  return AND(open, OR(divide, halvings > 0));
}

// Finds the first part of [0, 1] in which the cubic changes sign once, but for `passing` that it
// passes over, and counts them off.
// @return where there is one
Bool isolate(Bool asked, Real b0, Real b1, Real b2, Real b3, INOUT(Whole) passing, INOUT(Real) low,
             INOUT(Real) high) {
  Whole changes = signChanges(b0, b1, b2, b3);
  Bool single = AND(asked, changes == 1);
  Bool found = AND(single, passing == 0);
  passing = passing - bit(AND(single, NOT(found)), 1);
  Bool open = AND(asked, changes > 1);
  low = real(0.0f);
  high = real(1.0f);
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
    Bool crosses = AND(open, OR(count == 1, AND(deepest, differ(c0 < 0.0f, c3 < 0.0f))));
    Bool ends = AND(crosses, passing == 0);
    passing = passing - bit(AND(crosses, NOT(ends)), 1);
    low = select(ends, u, low);
    high = select(ends, w, high);
    found = OR(found, ends);
    open = AND(open, NOT(ends));
    open = resume(open, AND(count > 1, NOT(deepest)), part, halvings, size);
  }
  return found;
}

// The parameter in [low, high] at which the cubic changes sign, once there.
// @param inside  is it negative at low?
Real bisect(Real b0, Real b1, Real b2, Real b3, Bool inside, Real low, Real high) {
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
  Real share;  // of the way through the cell
  Bool enters;
  Bool endsInside;
};

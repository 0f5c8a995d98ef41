// Shape of the surface at a hit: gradient and Hessian of the tricubic B-spline with coefficients f
// − ∇²f/6 [Sigg05], and gradient of the trilinear interpolant. If the filter is a tricubic spline
// (isSpline), all of these are derivatives of that spline. Types and coordinates are those of
// roots.glsl.
//
// The coefficients are not computed. Instead, each grid value has the weight of its coefficient
// minus a sixth of the second differences of the weights. So each grid value is loaded once, and
// none is kept in an array, because Mesa 22.3 reads arrays by slow gathers.

CONST_FLOAT kSixth = 0.16666666667f;
CONST_FLOAT kEighth = 0.125f;

// Weights along one axis of the six points from cell − 2 on. `value`, `slope` and `bend` are the
// weights of the uniform cubic B-spline and of its first and second derivative; they are 0 for the
// first and last point. `valueBend`, `slopeBend` and `bendBend` are a sixth of their second
// differences.
struct Stencil {
  Real value[6], slope[6], bend[6];
  Real valueBend[6], slopeBend[6], bendBend[6];
};

void fillStencil(INOUT_ARRAY(Real, weight, 6), INOUT_ARRAY(Real, bend, 6), Real p0, Real p1, Real p2,
                 Real p3) {
  VAR sixth = real(isSpline ? 0.0f : kSixth);
  VAR b0 = p0 * sixth;
  VAR b1 = (p1 - (p0 + p0)) * sixth;
  VAR b2 = ((p0 + p2) - (p1 + p1)) * sixth;
  VAR b3 = ((p1 + p3) - (p2 + p2)) * sixth;
  VAR b4 = (p2 - (p3 + p3)) * sixth;
  VAR b5 = p3 * sixth;
  weight[0] = real(0.0f);
  weight[1] = p0;
  weight[2] = p1;
  weight[3] = p2;
  weight[4] = p3;
  weight[5] = real(0.0f);
  bend[0] = b0;
  bend[1] = b1;
  bend[2] = b2;
  bend[3] = b3;
  bend[4] = b4;
  bend[5] = b5;
}

Stencil stencilAt(Real a) {
  VAR b = 1.0f - a;
  Stencil w;
  if (isTricubic) {
    VAR c0 = a * b * b * -0.5f;
    VAR c3 = a * a * b * -0.5f;
    VAR c1 = (1.5f * a - 2.5f) * (a * a) + 1.0f;
    VAR c2 = (1.5f * b - 2.5f) * (b * b) + 1.0f;
    VAR d0 = (1.5f * a - 0.5f) * b;
    VAR d1 = (4.5f * a - 5.0f) * a;
    VAR d2 = (5.0f - 4.5f * b) * b;
    VAR d3 = (0.5f - 1.5f * b) * a;
    VAR e0 = 2.0f - 3.0f * a;
    VAR e1 = 9.0f * a - 5.0f;
    VAR e2 = 9.0f * b - 5.0f;
    VAR e3 = 2.0f - 3.0f * b;
    fillStencil(w.value, w.valueBend, c0, c1, c2, c3);
    fillStencil(w.slope, w.slopeBend, d0, d1, d2, d3);
    fillStencil(w.bend, w.bendBend, e0, e1, e2, e3);
    return w;
  }
  VAR aa = a * a;
  VAR bb = b * b;
  VAR v0 = bb * b * kSixth;
  VAR v1 = (3.0f * aa * a - 6.0f * aa + 4.0f) * kSixth;
  VAR v2 = (3.0f * bb * b - 6.0f * bb + 4.0f) * kSixth;
  VAR v3 = aa * a * kSixth;
  VAR s0 = bb * -0.5f;
  VAR s1 = a * (1.5f * a - 2.0f);
  VAR s2 = b * (2.0f - 1.5f * b);
  VAR s3 = aa * 0.5f;
  VAR b1 = 3.0f * a - 2.0f;
  VAR b2 = 3.0f * b - 2.0f;
  fillStencil(w.value, w.valueBend, v0, v1, v2, v3);
  fillStencil(w.slope, w.slopeBend, s0, s1, s2, s3);
  fillStencil(w.bend, w.bendBend, b, b1, b2, a);
  return w;
}

// Values of the six grid points along z of a Window (6³ points around the cell) that have the
// indices (i, j) in x and y.
struct Column {
  Real f0, f1, f2, f3, f4, f5;
};

Column columnAt(IN(Window) w, int i, int j) {
  Int nearBlocks = firstAt(w, i, j, 0);
  Int farBlocks = firstAt(w, i, j, 1);
  Column c;
  c.f0 = loadValue(select(w.farZ[0], farBlocks, nearBlocks) + w.stepZ[0]);
  c.f1 = loadValue(select(w.farZ[1], farBlocks, nearBlocks) + w.stepZ[1]);
  c.f2 = loadValue(select(w.farZ[2], farBlocks, nearBlocks) + w.stepZ[2]);
  c.f3 = loadValue(select(w.farZ[3], farBlocks, nearBlocks) + w.stepZ[3]);
  c.f4 = loadValue(select(w.farZ[4], farBlocks, nearBlocks) + w.stepZ[4]);
  c.f5 = loadValue(select(w.farZ[5], farBlocks, nearBlocks) + w.stepZ[5]);
  return c;
}

// A column with 0 in place of its first and last value, which the tables do not store if i or j is
// 0 or 5.
Column shortColumnAt(IN(Window) w, int i, int j) {
  Int nearBlocks = firstAt(w, i, j, 0);
  Int farBlocks = firstAt(w, i, j, 1);
  Column c;
  c.f0 = real(0.0f);
  c.f1 = loadValue(select(w.farZ[1], farBlocks, nearBlocks) + w.stepZ[1]);
  c.f2 = loadValue(select(w.farZ[2], farBlocks, nearBlocks) + w.stepZ[2]);
  c.f3 = loadValue(select(w.farZ[3], farBlocks, nearBlocks) + w.stepZ[3]);
  c.f4 = loadValue(select(w.farZ[4], farBlocks, nearBlocks) + w.stepZ[4]);
  c.f5 = real(0.0f);
  return c;
}

Real inner(IN(Column) c, IN_ARRAY(Real, weight, 6)) {
  VAR sum = (c.f1 * weight[1] + c.f2 * weight[2]) + (c.f3 * weight[3] + c.f4 * weight[4]);
  return sum;
}

Real whole6(IN(Column) c, IN_ARRAY(Real, weight, 6)) {
  VAR sum = (c.f0 * weight[0] + c.f5 * weight[5]) +
            ((c.f1 * weight[1] + c.f2 * weight[2]) + (c.f3 * weight[3] + c.f4 * weight[4]));
  return sum;
}

// Derivatives along y and z in one slab (the grid points with one x); the two digits are the orders
// along y and z. r…: for the grid values f as spline coefficients. p…: for coefficients f − ∇²f/6,
// where ∇² lacks the second difference along x.
struct Slab {
  Real r00, r10, r20, r01, r11, r02;
  Real p00, p10, p20, p01, p11, p02;
};

Slab noSlab() {
  Slab s;
  s.r00 = s.r10 = s.r20 = s.r01 = s.r11 = s.r02 = real(0.0f);
  s.p00 = s.p10 = s.p20 = s.p01 = s.p11 = s.p02 = real(0.0f);
  return s;
}

Real plus(Real sum, Real a, Real b) {
  VAR result = sum + a * b;
  return result;
}

Real minus(Real sum, Real a, Real b) {
  VAR result = sum - a * b;
  return result;
}

void addValues(INOUT(Slab) s, IN(Column) c, IN(Stencil) y, IN(Stencil) z, int j) {
  VAR v = inner(c, z.value);
  VAR slope = inner(c, z.slope);
  VAR bend = inner(c, z.bend);
  s.r00 = plus(s.r00, y.value[j], v);
  s.r10 = plus(s.r10, y.slope[j], v);
  s.r20 = plus(s.r20, y.bend[j], v);
  s.r01 = plus(s.r01, y.value[j], slope);
  s.r11 = plus(s.r11, y.slope[j], slope);
  s.r02 = plus(s.r02, y.value[j], bend);
  s.p00 = minus(s.p00, y.valueBend[j], v);
  s.p10 = minus(s.p10, y.slopeBend[j], v);
  s.p20 = minus(s.p20, y.bendBend[j], v);
  s.p01 = minus(s.p01, y.valueBend[j], slope);
  s.p11 = minus(s.p11, y.slopeBend[j], slope);
  s.p02 = minus(s.p02, y.valueBend[j], bend);
}

void addColumn(INOUT(Slab) s, IN(Column) c, IN(Stencil) y, IN(Stencil) z, int j) {
  addValues(s, c, y, z, j);
  VAR v = inner(c, z.value) - whole6(c, z.valueBend);
  VAR slope = inner(c, z.slope) - whole6(c, z.slopeBend);
  VAR bend = inner(c, z.bend) - whole6(c, z.bendBend);
  s.p00 = plus(s.p00, y.value[j], v);
  s.p10 = plus(s.p10, y.slope[j], v);
  s.p20 = plus(s.p20, y.bend[j], v);
  s.p01 = plus(s.p01, y.value[j], slope);
  s.p11 = plus(s.p11, y.slope[j], slope);
  s.p02 = plus(s.p02, y.value[j], bend);
}

struct Shape {
  Real gx, gy, gz;                    // gradient of the B-spline, φ per voxel
  Real tx, ty, tz;                    // gradient of the trilinear interpolant, φ per voxel
  Real hxx, hyy, hzz, hxy, hxz, hyz;  // Hessian of the B-spline, φ per voxel²
  Real error;                         // bound on |trilinear interpolant − smooth function|, from second differences
  Real inX, inY, inZ;                 // position in the cell, from 0 to 1
};

// Subtracts from the derivatives the share of one slab in a sixth of the second differences along
// x. `value`, `slope` and `bend` are the weights valueBend, slopeBend and bendBend of the slab
// along x.
void takeBeside(INOUT(Shape) shape, IN(Slab) s, Real value, Real slope, Real bend) {
  shape.gx = minus(shape.gx, slope, s.r00);
  shape.gy = minus(shape.gy, value, s.r10);
  shape.gz = minus(shape.gz, value, s.r01);
  shape.hxx = minus(shape.hxx, bend, s.r00);
  shape.hxy = minus(shape.hxy, slope, s.r10);
  shape.hxz = minus(shape.hxz, slope, s.r01);
  shape.hyy = minus(shape.hyy, value, s.r20);
  shape.hyz = minus(shape.hyz, value, s.r11);
  shape.hzz = minus(shape.hzz, value, s.r02);
}

void addSlab(INOUT(Shape) shape, IN(Slab) s, Real value, Real slope, Real bend) {
  shape.gx = plus(shape.gx, slope, s.p00);
  shape.gy = plus(shape.gy, value, s.p10);
  shape.gz = plus(shape.gz, value, s.p01);
  shape.hxx = plus(shape.hxx, bend, s.p00);
  shape.hxy = plus(shape.hxy, slope, s.p10);
  shape.hxz = plus(shape.hxz, slope, s.p01);
  shape.hyy = plus(shape.hyy, value, s.p20);
  shape.hyz = plus(shape.hyz, value, s.p11);
  shape.hzz = plus(shape.hzz, value, s.p02);
}

Real magnitude(Real v) { return select(v < 0.0f, 0.0f - v, v); }

Real bendOf(Real before, Real at, Real after) {
  VAR bend = (before + after) - (at + at);
  return magnitude(bend);
}

// f…: φ at the four points of a slab that are corners of the cell (points 2 and 3 of the Window
// along y and z). b…: sums of the magnitudes of the second differences along y and z at these
// points.
struct Corners {
  Real f00, f01, f10, f11;
  Real b00, b01, b10, b11;
};

Corners cornersOf(IN(Column) c1, IN(Column) c2, IN(Column) c3, IN(Column) c4) {
  Corners c;
  c.f00 = c2.f2;
  c.f01 = c2.f3;
  c.f10 = c3.f2;
  c.f11 = c3.f3;
  VAR b00 = bendOf(c1.f2, c2.f2, c3.f2) + bendOf(c2.f1, c2.f2, c2.f3);
  VAR b01 = bendOf(c1.f3, c2.f3, c3.f3) + bendOf(c2.f2, c2.f3, c2.f4);
  VAR b10 = bendOf(c2.f2, c3.f2, c4.f2) + bendOf(c3.f1, c3.f2, c3.f3);
  VAR b11 = bendOf(c2.f3, c3.f3, c4.f3) + bendOf(c3.f2, c3.f3, c3.f4);
  c.b00 = b00;
  c.b01 = b01;
  c.b10 = b10;
  c.b11 = b11;
  return c;
}

// Bound on the error of trilinear interpolation, from second differences of φ at the corners of the
// cell in one slab (`at`). `before` and `after` are the neighbouring slabs.
Real errorOf(IN(Corners) before, IN(Corners) at, IN(Corners) after) {
  VAR e00 = bendOf(before.f00, at.f00, after.f00) + at.b00;
  VAR e01 = bendOf(before.f01, at.f01, after.f01) + at.b01;
  VAR e10 = bendOf(before.f10, at.f10, after.f10) + at.b10;
  VAR e11 = bendOf(before.f11, at.f11, after.f11) + at.b11;
  VAR most = larger(larger(e00, e01), larger(e10, e11)) * kEighth;
  return most;
}

// Sets the gradient of the trilinear interpolant in the cell between two slabs. (a, b, c) is the
// position in the cell, each from 0 to 1.
void addTrilinear(INOUT(Shape) shape, IN(Corners) low, IN(Corners) high, Real a, Real b, Real c) {
  VAR ra = 1.0f - a;
  VAR rb = 1.0f - b;
  VAR rc = 1.0f - c;
  // Values of each slab, interpolated along y and z; then their derivatives along y and z.
  VAR v0 = between(between(low.f00, low.f01, c, rc), between(low.f10, low.f11, c, rc), b, rb);
  VAR v1 = between(between(high.f00, high.f01, c, rc), between(high.f10, high.f11, c, rc), b, rb);
  VAR y0 = between(low.f10 - low.f00, low.f11 - low.f01, c, rc);
  VAR y1 = between(high.f10 - high.f00, high.f11 - high.f01, c, rc);
  VAR z0 = between(low.f01 - low.f00, low.f11 - low.f10, b, rb);
  VAR z1 = between(high.f01 - high.f00, high.f11 - high.f10, b, rb);
  VAR tx = v1 - v0;
  shape.tx = tx;
  shape.ty = between(y0, y1, a, ra);
  shape.tz = between(z0, z1, a, ra);
}

// Computes the shape of the surface at a position.
// @param asked  active lanes
// @param cellX, cellY, cellZ  cell that contains the position
// @param a, b, c  position in the cell, from 0 to 1
Shape shapeAt(Bool asked, Int cellX, Int cellY, Int cellZ, Real a, Real b, Real c) {
  Window w = windowAt(asked, cellX, cellY, cellZ);
  Stencil x = stencilAt(a);
  Stencil y = stencilAt(b);
  Stencil z = stencilAt(c);
  Shape shape;
  shape.gx = shape.gy = shape.gz = shape.tx = shape.ty = shape.tz = real(0.0f);
  shape.hxx = shape.hyy = shape.hzz = shape.hxy = shape.hxz = shape.hyz = real(0.0f);
  shape.error = real(0.0f);
  Corners before;
  Corners last;
  before.f00 = before.f01 = before.f10 = before.f11 = real(0.0f);
  before.b00 = before.b01 = before.b10 = before.b11 = real(0.0f);
  last = before;
  for (int i = 1; i < 5; ++i) {
    Column c1 = columnAt(w, i, 1);
    Column c2 = columnAt(w, i, 2);
    Column c3 = columnAt(w, i, 3);
    Column c4 = columnAt(w, i, 4);
    Slab s = noSlab();
    if (!isSpline) {
      addValues(s, shortColumnAt(w, i, 0), y, z, 0);
      addValues(s, shortColumnAt(w, i, 5), y, z, 5);
    }
    addColumn(s, c1, y, z, 1);
    addColumn(s, c2, y, z, 2);
    addColumn(s, c3, y, z, 3);
    addColumn(s, c4, y, z, 4);
    addSlab(shape, s, x.value[i], x.slope[i], x.bend[i]);
    takeBeside(shape, s, x.valueBend[i], x.slopeBend[i], x.bendBend[i]);
    Corners now = cornersOf(c1, c2, c3, c4);
    if (i == 3) addTrilinear(shape, last, now, a, b, c);
    if (i >= 3) shape.error = larger(shape.error, errorOf(before, last, now));
    before = last;
    last = now;
  }
  for (int i = isSpline ? 6 : 0; i < 6; i += 5) {
    Slab s = noSlab();
    addValues(s, shortColumnAt(w, i, 1), y, z, 1);
    addValues(s, shortColumnAt(w, i, 2), y, z, 2);
    addValues(s, shortColumnAt(w, i, 3), y, z, 3);
    addValues(s, shortColumnAt(w, i, 4), y, z, 4);
    takeBeside(shape, s, x.valueBend[i], x.slopeBend[i], x.bendBend[i]);
  }
  if (isSpline) {  // the drawn surface is the zero set of the spline
    shape.tx = shape.gx;
    shape.ty = shape.gy;
    shape.tz = shape.gz;
    shape.error = real(0.0f);
  }
  return shape;
}

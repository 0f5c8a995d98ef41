// Crossings of a ray with the zero set of a tricubic B-spline whose coefficients the grid stores, or
// of the Catmull-Rom spline through its values (isTricubic) [Keys81]. Types and coordinates are
// those of roots.glsl.
//
// Along a line the spline has degree 9 within a cell. Its Bernstein coefficients follow from the
// Bézier net of the box that the ray's segment spans. Each coefficient is a sum of nonnegative
// multiples of the net's values. So if all values of the net have one sign, the coefficients have
// it too, in spite of rounding.

CONST_INT kDegree = 9;

// Weights of the four grid values along an axis, from point cell − 1 on, in the blossom of the spline
// at (u, v, w).
struct Blend {
  Real w0, w1, w2, w3;
};

// For the Catmull-Rom spline. Its Bézier points in the cell are f1, f1 + (f2 − f0)/6, f2 − (f3 −
// f1)/6 and f2. `p…` are their weights.
Blend catmullRomBlendOf(Real u, Real v, Real w) {
  VAR ru = 1.0f - u;
  VAR rv = 1.0f - v;
  VAR rw = 1.0f - w;
  VAR q0 = rv * rw;
  VAR q1 = v * rw + w * rv;
  VAR q2 = v * w;
  VAR p1 = q0 * u + q1 * ru;
  VAR p2 = q1 * u + q2 * ru;
  VAR n1 = p1 * NUMBER(1.0 / 6.0);
  VAR n2 = p2 * NUMBER(1.0 / 6.0);
  VAR w1 = (q0 * ru + p1) + n2;
  VAR w2 = (q2 * u + p2) + n1;
  Blend b;
  b.w0 = 0.0f - n1;
  b.w1 = w1;
  b.w2 = w2;
  b.w3 = 0.0f - n2;
  return b;
}

Blend blendOf(Real u, Real v, Real w) {
  if (isTricubic) return catmullRomBlendOf(u, v, w);
  VAR rw = 1.0f - w;
  VAR p0 = rw * (1.0f - v) * 0.5f;
  VAR p1 = (rw * (1.0f + v) + w * (2.0f - v)) * 0.5f;
  VAR p2 = w * v * 0.5f;
  VAR w0 = p0 * (1.0f - u) * kThird;
  VAR w1 = (p0 * (2.0f + u) + p1 * (2.0f - u)) * kThird;
  VAR w2 = (p1 * (1.0f + u) + p2 * (3.0f - u)) * kThird;
  VAR w3 = p2 * u * kThird;
  Blend b;
  b.w0 = w0;
  b.w1 = w1;
  b.w2 = w2;
  b.w3 = w3;
  return b;
}

Real blended(IN(Blend) b, Real c0, Real c1, Real c2, Real c3) {
  VAR sum = (b.w0 * c0 + b.w1 * c1) + (b.w2 * c2 + b.w3 * c3);
  return sum;
}

// Works on each row of four values of the net along the axis with the given stride. Replaces the
// grid values of the row by the values of the Bézier net between the positions `from` and
// `to` in the cell.
void bendAxis(INOUT_ARRAY(Real, net, 64), int stride, Real from, Real to) {
  Blend b0 = blendOf(from, from, from);
  Blend b1 = blendOf(from, from, to);
  Blend b2 = blendOf(from, to, to);
  Blend b3 = blendOf(to, to, to);
  int across = stride == 1 ? 4 : 1;
  int along = stride == 16 ? 4 : 16;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      int n = i * along + j * across;
      VAR c0 = net[n];
      VAR c1 = net[n + stride];
      VAR c2 = net[n + 2 * stride];
      VAR c3 = net[n + 3 * stride];
      net[n] = blended(b0, c0, c1, c2, c3);
      net[n + stride] = blended(b1, c0, c1, c2, c3);
      net[n + 2 * stride] = blended(b2, c0, c1, c2, c3);
      net[n + 3 * stride] = blended(b3, c0, c1, c2, c3);
    }
  }
}

Int countChanges(IN_ARRAY(Real, b, 10)) {
  Int count = integer(0);
  for (int i = 0; i < kDegree; ++i) count = count + bit(differ(b[i] < 0.0f, b[i + 1] < 0.0f), 1);
  return count;
}

// Replaces the Bernstein coefficients of a polynomial by those of the left or right half of its
// interval. The loops have fixed bounds, because Mesa 22.3 loses writes of nested loops with
// variable bounds.
void halve(INOUT_ARRAY(Real, b, 10), Bool asked, Bool right) {
  VAR l[10];
  VAR r[10];
  for (int i = 0; i <= kDegree; ++i) {
    l[i] = b[i];
    r[i] = b[i];
  }
  for (int n = 1; n <= kDegree; ++n) {
    for (int i = kDegree; i >= 1; --i)
      if (i >= n) l[i] = (l[i - 1] + l[i]) * 0.5f;
    for (int i = 0; i < kDegree; ++i)
      if (i <= kDegree - n) r[i] = (r[i] + r[i + 1]) * 0.5f;
  }
  for (int i = 0; i <= kDegree; ++i) b[i] = select(asked, select(right, r[i], l[i]), b[i]);
}

Real valueAt(IN_ARRAY(Real, b, 10), Real u) {
  VAR ru = 1.0f - u;
  VAR c[10];
  for (int i = 0; i <= kDegree; ++i) c[i] = b[i];
  for (int n = 1; n <= kDegree; ++n) {
    for (int i = 0; i < kDegree; ++i)
      if (i <= kDegree - n) c[i] = between(c[i], c[i + 1], u, ru);
  }
  return c[0];
}

// Finds the first interval [low, high] in [0, 1] with a single sign change of the polynomial, after
// skipping `passing` sign changes. Works as isolate() in roots.glsl.
Bool isolateSpline(Bool asked, IN_ARRAY(Real, b, 10), INOUT(Int) passing, INOUT(Real) low,
                   INOUT(Real) high) {
  Int changes = countChanges(b);
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
    VAR c[10];
    for (int i = 0; i <= kDegree; ++i) c[i] = b[i];
    for (int n = kMostHalvings - 1; n >= 0; --n) {
      Bool deep = AND(open, halvings > n);
      if (any(deep)) halve(c, deep, ((part >> n) & 1) != 0);
    }
    Int count = countChanges(c);
    Bool deepest = halvings == kMostHalvings;
    Bool crosses = AND(open, OR(count == 1, AND(deepest, differ(c[0] < 0.0f, c[kDegree] < 0.0f))));
    Bool ends = AND(crosses, passing == 0);
    passing = passing - bit(AND(crosses, NOT(ends)), 1);
    VAR u = toReal(part) * size;
    VAR w = toReal(part + 1) * size;
    low = select(ends, u, low);
    high = select(ends, w, high);
    found = OR(found, ends);
    open = AND(open, NOT(ends));
    open = nextPart(open, AND(count > 1, NOT(deepest)), part, halvings, size);
  }
  return found;
}

// Finds a crossing of a ray with the spline's zero set between two points of a cell. Their
// coordinates run from 0 to 1 within the cell.
// @param carried  true when the ray's side of the surface at the end of the previous cell is known
// @param inside  that side: true for inside
// @param passing  number of crossings to skip; crossings skipped in this cell are subtracted
Crossing splineCrossingIn(Bool asked, Int cellX, Int cellY, Int cellZ, Real x0, Real y0,
                          Real z0, Real x1, Real y1, Real z1, Bool carried, Bool inside,
                          INOUT(Int) passing) {
  Window w = windowAt(asked, cellX, cellY, cellZ);
  VAR net[64];
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      Int nearBlocks = firstAt(w, i + 1, j + 1, 0);
      Int farBlocks = firstAt(w, i + 1, j + 1, 1);
      for (int k = 0; k < 4; ++k)
        net[16 * i + 4 * j + k] =
            loadValue(select(w.farZ[k + 1], farBlocks, nearBlocks) + w.stepZ[k + 1]);
    }
  }
  bendAxis(net, 1, z0, z1);
  bendAxis(net, 4, y0, y1);
  bendAxis(net, 16, x0, x1);

  VAR b[10];
  for (int n = 0; n <= kDegree; ++n) b[n] = real(0.0f);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      for (int k = 0; k < 4; ++k) {
        float ways = (i == 1 || i == 2 ? 3.0f : 1.0f) * (j == 1 || j == 2 ? 3.0f : 1.0f) *
                     (k == 1 || k == 2 ? 3.0f : 1.0f);
        b[i + j + k] = b[i + j + k] + net[16 * i + 4 * j + k] * ways;
      }
    }
  }
  b[1] = b[1] * NUMBER(1.0 / 9.0);
  b[2] = b[2] * NUMBER(1.0 / 36.0);
  b[3] = b[3] * NUMBER(1.0 / 84.0);
  b[4] = b[4] * NUMBER(1.0 / 126.0);
  b[5] = b[5] * NUMBER(1.0 / 126.0);
  b[6] = b[6] * NUMBER(1.0 / 84.0);
  b[7] = b[7] * NUMBER(1.0 / 36.0);
  b[8] = b[8] * NUMBER(1.0 / 9.0);
  b[0] = select(carried, onSide(b[0], inside), b[0]);

  Crossing crossing;
  Real low;
  Real high;
  crossing.found = isolateSpline(asked, b, passing, low, high);
  crossing.endsInside = b[kDegree] < 0.0f;
  crossing.share = real(0.0f);
  crossing.enters = no();
  if (any(crossing.found)) {
    Bool startsInside = valueAt(b, low) < 0.0f;
    crossing.enters = NOT(startsInside);
    for (int i = 0; i < kBisections; ++i) {
      VAR middle = (low + high) * 0.5f;
      Bool same = NOT(differ(valueAt(b, middle) < 0.0f, startsInside));
      low = select(same, middle, low);
      high = select(same, high, middle);
    }
    crossing.share = (low + high) * 0.5f;
  }
  return crossing;
}

// Shape of the spline on truncated octahedra (bcc.glsl) at a position. Types and coordinates are
// those of roots.glsl.

// Rows of the Hessian and gradient are sums over the vertices with the gradients of the barycentric
// coordinates, which are constant in a tetrahedron.
Shape bccShapeAt(Bool asked, Int cellX, Int cellY, Int cellZ, Real inX, Real inY, Real inZ) {
  Spot spot = spotAt(asked, cellX, cellY, cellZ);
  VAR x = inX - 0.5f;
  VAR y = inY - 0.5f;
  VAR z = inZ - 0.5f;
  BccTet t = bccTetAt(cellX, cellY, cellZ, x, y, z);
  Weights w = bccWeights(t.kind, fromSite(t, x, y, z));
  QuadraticForm q = bccForm(asked, spot.brick, cellX, cellY, cellZ, t);
  // Gradients of the four coordinates along a, b and c.
  Bool isSquare = t.kind == 0;
  Bool isThird = t.kind == 2;
  Real third = real(NUMBER(-2.0 / 3.0));
  Real zero = real(0.0f);
  Weights alongA;
  alongA.w0 = select(isSquare, real(-1.0f), third);
  alongA.w1 = select(isSquare, real(1.0f), select(isThird, zero, third));
  alongA.w2 = select(isSquare, zero, select(isThird, real(NUMBER(-4.0 / 3.0)), real(NUMBER(4.0 / 3.0))));
  alongA.w3 = select(isThird, real(2.0f), zero);
  Weights alongB;
  alongB.w0 = select(isSquare, zero, third);
  alongB.w1 = select(isSquare, real(-2.0f), select(isThird, zero, real(NUMBER(4.0 / 3.0))));
  alongB.w2 = select(isSquare, zero, select(isThird, real(NUMBER(8.0 / 3.0)), real(NUMBER(-8.0 / 3.0))));
  alongB.w3 = select(isThird, real(-2.0f), real(2.0f));
  Weights alongC;
  alongC.w0 = select(isSquare, zero, third);
  alongC.w1 = select(isSquare, real(-2.0f), select(isThird, real(2.0f), real(NUMBER(4.0 / 3.0))));
  alongC.w2 = select(isSquare, real(4.0f), select(isThird, real(NUMBER(-4.0 / 3.0)), real(NUMBER(4.0 / 3.0))));
  alongC.w3 = select(isThird, zero, real(-2.0f));
  Weights row = fixedAt(q, w);
  VAR ga = weighted(alongA, row) * 2.0f;
  VAR gb = weighted(alongB, row) * 2.0f;
  VAR gc = weighted(alongC, row) * 2.0f;
  Weights rowA = fixedAt(q, alongA);
  Weights rowB = fixedAt(q, alongB);
  Weights rowC = fixedAt(q, alongC);
  VAR haa = weighted(alongA, rowA) * 2.0f;
  VAR hab = weighted(alongA, rowB) * 2.0f;
  VAR hac = weighted(alongA, rowC) * 2.0f;
  VAR hbb = weighted(alongB, rowB) * 2.0f;
  VAR hbc = weighted(alongB, rowC) * 2.0f;
  VAR hcc = weighted(alongC, rowC) * 2.0f;
  // Back to the axes of the table.
  VAR gx = (t.aX * ga + t.bX * gb) + t.cX * gc;
  VAR gy = (t.aY * ga + t.bY * gb) + t.cY * gc;
  VAR gz = (t.aZ * ga + t.bZ * gb) + t.cZ * gc;
  VAR ax = (haa * t.aX + hab * t.bX) + hac * t.cX;
  VAR bx = (hab * t.aX + hbb * t.bX) + hbc * t.cX;
  VAR cx = (hac * t.aX + hbc * t.bX) + hcc * t.cX;
  VAR ay = (haa * t.aY + hab * t.bY) + hac * t.cY;
  VAR by = (hab * t.aY + hbb * t.bY) + hbc * t.cY;
  VAR cy = (hac * t.aY + hbc * t.bY) + hcc * t.cY;
  VAR az = (haa * t.aZ + hab * t.bZ) + hac * t.cZ;
  VAR bz = (hab * t.aZ + hbb * t.bZ) + hbc * t.cZ;
  VAR cz = (hac * t.aZ + hbc * t.bZ) + hcc * t.cZ;
  VAR hxx = (t.aX * ax + t.bX * bx) + t.cX * cx;
  VAR hyy = (t.aY * ay + t.bY * by) + t.cY * cy;
  VAR hzz = (t.aZ * az + t.bZ * bz) + t.cZ * cz;
  VAR hxy = (t.aX * ay + t.bX * by) + t.cX * cy;
  VAR hxz = (t.aX * az + t.bX * bz) + t.cX * cz;
  VAR hyz = (t.aY * az + t.bY * bz) + t.cY * cz;
  Shape shape;
  shape.gx = gx;
  shape.gy = gy;
  shape.gz = gz;
  shape.hxx = hxx;
  shape.hyy = hyy;
  shape.hzz = hzz;
  shape.hxy = hxy;
  shape.hxz = hxz;
  shape.hyz = hyz;
  shape.tx = gx;
  shape.ty = gy;
  shape.tz = gz;
  shape.error = zero;
  return shape;
}

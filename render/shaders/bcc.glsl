// Crossings of a ray with the zero set of the quadratic C1 spline Q2 on the truncated octahedra of a
// body-centred cubic lattice [Kalbe11]. Types and coordinates are those of roots.glsl.
//
// The octahedra have their sites in the middles of the cells whose three numbers are all even or all
// odd. In the frame of a tetrahedron, coordinates from the site are a >= b >= c >= 0, and its
// vertices are the site v0 and, by its kind,
//   0: (1, 0, 0), (1, 1/4, 1/4), (1, 1/2, 0)         v1 is the middle of a square
//   1: (1/2, 1/2, 1/2), (1, 1/4, 1/4), (1, 1/2, 0)   v1 is the middle of a hexagon
//   2: (1/2, 1/2, 1/2), (3/4, 3/4, 0), (1, 1/2, 0)
// Four octahedra meet at v3, with their sites at (0, 0, 0), (2, 0, 0), (1, 1, 1) and (1, 1, -1).

CONST_INT kMostPieces = 100;  // more tetrahedra than a ray meets in a cell

// Mean and half differences of the eight values at the corners of a site's cell. They give the affine
// function mean + difference · v for v from the site.
struct Site {
  Real mean, x, y, z;
};

// @param x, y, z  cell of the site, from the first cell of the brick on
Site siteOf(Bool asked, Int brick, Int x, Int y, Int z) {
  Int n = (((x & 1) * 6 + ((x + 2) >> 1)) * 6 + ((y + 2) >> 1)) * 6 + ((z + 2) >> 1);
  n = smaller(larger(n, integer(0)), integer(kSites - 1));
  Int first = select(asked, brick * (4 * kSites) + 4 * n, integer(0));
  Site site;
  loadFour(first, site.mean, site.x, site.y, site.z);
  return site;
}

// A tetrahedron. The site is given from the middle of the cell through which the ray passes. The
// vectors a, b and c are the axes of the frame.
struct BccTet {
  Real siteX, siteY, siteZ;
  Real aX, aY, aZ, bX, bY, bZ, cX, cY, cZ;
  Int kind;
};

// Coordinates in the frame of a tetrahedron.
struct InFrame {
  Real a, b, c;
};

InFrame inFrame(IN(BccTet) t, Real x, Real y, Real z) {
  VAR a = (t.aX * x + t.aY * y) + t.aZ * z;
  VAR b = (t.bX * x + t.bY * y) + t.bZ * z;
  VAR c = (t.cX * x + t.cY * y) + t.cZ * z;
  InFrame f;
  f.a = a;
  f.b = b;
  f.c = c;
  return f;
}

InFrame fromSite(IN(BccTet) t, Real x, Real y, Real z) {
  VAR dx = x - t.siteX;
  VAR dy = y - t.siteY;
  VAR dz = z - t.siteZ;
  return inFrame(t, dx, dy, dz);
}

void exchangeAxes(Bool when, INOUT(Real) x, INOUT(Real) y, INOUT(Real) z, INOUT(Real) otherX,
                  INOUT(Real) otherY, INOUT(Real) otherZ) {
  exchange(when, x, otherX);
  exchange(when, y, otherY);
  exchange(when, z, otherZ);
}

// The tetrahedron with a point of a cell. @param x, y, z  the point, from the middle of the cell
BccTet bccTetAt(Int cellX, Int cellY, Int cellZ, Real x, Real y, Real z) {
  Bool sameXY = ((cellX ^ cellY) & 1) == 0;
  Bool sameYZ = ((cellY ^ cellZ) & 1) == 0;
  Bool sameXZ = ((cellX ^ cellZ) & 1) == 0;
  Bool alike = AND(sameXY, sameYZ);
  Bool oddX = AND(sameYZ, NOT(alike));
  Bool oddY = AND(sameXZ, NOT(alike));
  Bool oddZ = AND(sameXY, NOT(alike));
  Real signX = select(x < 0.0f, real(-1.0f), real(1.0f));
  Real signY = select(y < 0.0f, real(-1.0f), real(1.0f));
  Real signZ = select(z < 0.0f, real(-1.0f), real(1.0f));
  // In a cell without a site, two octahedra meet at a square in its middle. Four others have their
  // sites beside it.
  VAR sizeX = x * signX;
  VAR sizeY = y * signY;
  VAR sizeZ = z * signZ;
  Real along = select(oddX, sizeX, select(oddY, sizeY, sizeZ));
  Real first = select(oddX, sizeY, sizeX);
  Real second = select(oddZ, sizeY, sizeZ);
  VAR limit = (first + second) - 0.5f;
  Bool own = along >= limit;
  Real zero = real(0.0f);
  BccTet t;
  t.siteX = select(alike, zero, select(differ(oddX, own), zero, signX));
  t.siteY = select(alike, zero, select(differ(oddY, own), zero, signY));
  t.siteZ = select(alike, zero, select(differ(oddZ, own), zero, signZ));
  VAR fromX = x - t.siteX;
  VAR fromY = y - t.siteY;
  VAR fromZ = z - t.siteZ;
  t.aX = select(fromX < 0.0f, real(-1.0f), real(1.0f));
  t.bY = select(fromY < 0.0f, real(-1.0f), real(1.0f));
  t.cZ = select(fromZ < 0.0f, real(-1.0f), real(1.0f));
  t.aY = t.aZ = t.bX = t.bZ = t.cX = t.cY = zero;
  VAR a = fromX * t.aX;
  VAR b = fromY * t.bY;
  VAR c = fromZ * t.cZ;
  for (int n = 0; n < 2; ++n) {
    Bool one = b > a;
    exchangeAxes(one, t.aX, t.aY, t.aZ, t.bX, t.bY, t.bZ);
    exchange(one, a, b);
    if (n == 0) {
      Bool two = c > b;
      exchangeAxes(two, t.bX, t.bY, t.bZ, t.cX, t.cY, t.cZ);
      exchange(two, b, c);
    }
  }
  VAR twice = (b + c) + (b + c);
  VAR both = b + b;
  VAR outer = a + c;
  t.kind = select(NOT(a < twice), integer(0), select(both > outer, integer(2), integer(1)));
  return t;
}

// The neighbour of a tetrahedron across the face opposite a vertex.
void stepAcross(INOUT(BccTet) t, Bool when, Int face) {
  Bool isSquare = t.kind == 0;
  Bool isThird = t.kind == 2;
  Bool outwards = AND(when, face == 0);
  Bool overSquare = AND(outwards, isSquare);
  Bool overHexagon = AND(outwards, NOT(isSquare));
  Bool changesC = AND(when, OR(AND(face == 1, isThird), AND(face == 2, isSquare)));
  Bool changesKind = AND(when, OR(AND(face == 1, NOT(isThird)), AND(face == 2, NOT(isSquare))));
  Bool swapsAB = AND(when, AND(face == 3, isThird));
  Bool swapsBC = AND(when, AND(face == 3, NOT(isThird)));
  VAR squareX = t.siteX + (t.aX + t.aX);
  VAR squareY = t.siteY + (t.aY + t.aY);
  VAR squareZ = t.siteZ + (t.aZ + t.aZ);
  VAR hexagonX = t.siteX + ((t.aX + t.bX) + t.cX);
  VAR hexagonY = t.siteY + ((t.aY + t.bY) + t.cY);
  VAR hexagonZ = t.siteZ + ((t.aZ + t.bZ) + t.cZ);
  t.siteX = select(overSquare, squareX, select(overHexagon, hexagonX, t.siteX));
  t.siteY = select(overSquare, squareY, select(overHexagon, hexagonY, t.siteY));
  t.siteZ = select(overSquare, squareZ, select(overHexagon, hexagonZ, t.siteZ));
  exchangeAxes(overHexagon, t.aX, t.aY, t.aZ, t.cX, t.cY, t.cZ);
  exchangeAxes(swapsAB, t.aX, t.aY, t.aZ, t.bX, t.bY, t.bZ);
  exchangeAxes(swapsBC, t.bX, t.bY, t.bZ, t.cX, t.cY, t.cZ);
  Real turnA = select(outwards, real(-1.0f), real(1.0f));
  Real turnB = select(overHexagon, real(-1.0f), real(1.0f));
  Real turnC = select(OR(overHexagon, changesC), real(-1.0f), real(1.0f));
  t.aX = t.aX * turnA;
  t.aY = t.aY * turnA;
  t.aZ = t.aZ * turnA;
  t.bX = t.bX * turnB;
  t.bY = t.bY * turnB;
  t.bZ = t.bZ * turnB;
  t.cX = t.cX * turnC;
  t.cY = t.cY * turnC;
  t.cZ = t.cZ * turnC;
  // The square's neighbour within the octahedron has kind 1; kinds 1 and 2 are neighbours, too.
  Int besideHexagon = integer(3) - t.kind;
  Int besideSquare = integer(1) - t.kind;
  t.kind = select(overHexagon, besideHexagon,
                  select(changesKind, select(face == 1, besideSquare, besideHexagon), t.kind));
}

// Barycentric coordinates of a point.
Weights bccWeights(Int kind, IN(InFrame) p) {
  VAR square0 = 1.0f - p.a;
  VAR square1 = p.a - ((p.b + p.c) + (p.b + p.c));
  VAR square2 = p.c * 4.0f;
  VAR hexagon0 = 1.0f - ((p.a + p.b) + p.c) * NUMBER(2.0 / 3.0);
  VAR second1 = ((p.b + p.c) * 4.0f - (p.a + p.a)) * NUMBER(1.0 / 3.0);
  VAR second2 = ((p.a + p.c) - (p.b + p.b)) * NUMBER(4.0 / 3.0);
  VAR third1 = p.c + p.c;
  VAR third2 = ((p.b + p.b) - (p.a + p.c)) * NUMBER(4.0 / 3.0);
  VAR last = (p.b - p.c) * 2.0f;
  VAR thirdLast = (p.a - p.b) * 2.0f;
  Weights w;
  w.w0 = select(kind == 0, square0, hexagon0);
  w.w1 = select(kind == 0, square1, select(kind == 1, second1, third1));
  w.w2 = select(kind == 0, square2, select(kind == 1, second2, third2));
  w.w3 = select(kind == 2, thirdLast, last);
  return w;
}

// The affine function of a site, with its slopes along the axes of a frame.
struct Affine {
  Real mean, a, b, c;
};

Affine affineOf(Bool asked, Int brick, Int cellX, Int cellY, Int cellZ, IN(BccTet) t, Real ofA, Real ofB,
                Real ofC) {
  VAR x = t.siteX + ((t.aX * ofA + t.bX * ofB) + t.cX * ofC);
  VAR y = t.siteY + ((t.aY * ofA + t.bY * ofB) + t.cY * ofC);
  VAR z = t.siteZ + ((t.aZ * ofA + t.bZ * ofB) + t.cZ * ofC);
  // Conversion to integers truncates.
  Site site = siteOf(asked, brick, (cellX & 7) + (toInt(x + 8.0f) - 8), (cellY & 7) + (toInt(y + 8.0f) - 8),
                     (cellZ & 7) + (toInt(z + 8.0f) - 8));
  InFrame slope = inFrame(t, site.x, site.y, site.z);
  Affine f;
  f.mean = site.mean;
  f.a = slope.a;
  f.b = slope.b;
  f.c = slope.c;
  return f;
}

Real affineAt(IN(Affine) f, Real a, Real b, Real c) {
  VAR value = f.mean + ((f.a * a + f.b * b) + f.c * c);
  return value;
}

// Bernstein coefficients in a tetrahedron. A coefficient between vertices is the mean of the affine
// functions of the sites around the first of them, at the second.
QuadraticForm bccForm(Bool asked, Int brick, Int cellX, Int cellY, Int cellZ, IN(BccTet) t) {
  Affine f0 = affineOf(asked, brick, cellX, cellY, cellZ, t, real(0.0f), real(0.0f), real(0.0f));
  Affine f1 = affineOf(asked, brick, cellX, cellY, cellZ, t, real(2.0f), real(0.0f), real(0.0f));
  Affine f2 = affineOf(asked, brick, cellX, cellY, cellZ, t, real(1.0f), real(1.0f), real(1.0f));
  Affine f3 = affineOf(asked, brick, cellX, cellY, cellZ, t, real(1.0f), real(1.0f), real(-1.0f));
  Bool isSquare = t.kind == 0;
  Bool isThird = t.kind == 2;
  // The vertices v1 and v2. The third coordinate is that of the second for v1, and for v2 of kinds 0
  // and 1.
  Real a1 = select(isSquare, real(1.0f), real(0.5f));
  Real b1 = select(isSquare, real(0.0f), real(0.5f));
  Real a2 = select(isThird, real(0.75f), real(1.0f));
  Real b2 = select(isThird, real(0.75f), real(0.25f));
  Real c2 = select(isThird, real(0.0f), real(0.25f));
  Real at01 = affineAt(f0, a1, b1, b1);
  Real at02 = affineAt(f0, a2, b2, c2);
  Real at03 = affineAt(f0, real(1.0f), real(0.5f), real(0.0f));
  Real at12 = affineAt(f1, real(-1.0f), real(0.25f), real(0.25f));
  Real at13 = affineAt(f1, real(-1.0f), real(0.5f), real(0.0f));
  Real at22 = affineAt(f2, a2 - 1.0f, b2 - 1.0f, c2 - 1.0f);
  Real at23 = affineAt(f2, real(0.0f), real(-0.5f), real(-1.0f));
  Real at32 = affineAt(f3, real(-0.25f), real(-0.25f), real(1.0f));
  Real at33 = affineAt(f3, real(0.0f), real(-0.5f), real(1.0f));
  // The other octahedron that meets at v1.
  Real across1 = select(isSquare, affineAt(f1, real(-1.0f), real(0.0f), real(0.0f)),
                        affineAt(f2, real(-0.5f), real(-0.5f), real(-0.5f)));
  Real across2 = select(isSquare, at12, at22);
  Real across3 = select(isSquare, at13, at23);
  VAR q11 = (at01 + across1) * 0.5f;
  VAR q12 = (at02 + across2) * 0.5f;
  VAR q13 = (at03 + across3) * 0.5f;
  VAR second22 = ((at02 + at12) * 3.0f + (at22 + at22)) * 0.125f;
  VAR second23 = ((at03 + at13) * 3.0f + (at23 + at23)) * 0.125f;
  VAR third22 = ((at22 + at32) * 3.0f + (at02 + at02)) * 0.125f;
  VAR third23 = ((at23 + at33) * 3.0f + (at03 + at03)) * 0.125f;
  VAR q33 = ((at03 + at13) + (at23 + at33)) * 0.25f;
  QuadraticForm q;
  q.q00 = f0.mean;
  q.q01 = at01;
  q.q02 = at02;
  q.q03 = at03;
  q.q11 = q11;
  q.q12 = q12;
  q.q13 = q13;
  q.q22 = select(isThird, third22, second22);
  q.q23 = select(isThird, third23, second23);
  q.q33 = q33;
  return q;
}

// Share of a segment at which it leaves a tetrahedron through a face; 1 if it does not. The weight of
// the opposite vertex is a at its begin and b at its end.
Real exitShare(Real a, Real b) {
  VAR change = a - b;
  Bool falls = b < a;
  VAR share = quotient(a, select(falls, change, real(1.0f)));
  return select(falls, share, real(1.0f));
}

// Finds a crossing of a ray with the spline's zero set between two points of a cell, in one
// tetrahedron after the other. Parameters as for crossingIn() and splineCrossingIn().
Crossing bccCrossingIn(Bool asked, Int brick, Int cellX, Int cellY, Int cellZ, Real x0, Real y0, Real z0,
                       Real x1, Real y1, Real z1, Bool carried, Bool inside, INOUT(Int) passing) {
  VAR px = x0 - 0.5f;
  VAR py = y0 - 0.5f;
  VAR pz = z0 - 0.5f;
  VAR qx = x1 - 0.5f;
  VAR qy = y1 - 0.5f;
  VAR qz = z1 - 0.5f;
  BccTet t = bccTetAt(cellX, cellY, cellZ, px, py, pz);
  Crossing crossing;
  crossing.found = no();
  crossing.enters = no();
  crossing.share = real(0.0f);
  Real h0 = real(0.0f);
  Real h1 = real(0.0f);
  Real h2 = real(0.0f);
  Real h3 = real(0.0f);
  Real foundLow = real(0.0f);
  Real foundHigh = real(0.0f);
  Real begin = real(0.0f);
  Real end = real(0.0f);
  Bool open = asked;
  Bool known = carried;
  Bool side = inside;
  Real from = real(0.0f);
  int pieces = 0;
  while (any(open)) {
    Weights wp = bccWeights(t.kind, fromSite(t, px, py, pz));
    Weights wq = bccWeights(t.kind, fromSite(t, qx, qy, qz));
    Real s0 = exitShare(wp.w0, wq.w0);
    Real s1 = exitShare(wp.w1, wq.w1);
    Real s2 = exitShare(wp.w2, wq.w2);
    Real s3 = exitShare(wp.w3, wq.w3);
    Real least = smaller(smaller(s0, s1), smaller(s2, s3));
    Int face = select(s0 == least, integer(0), select(s1 == least, integer(1), select(s2 == least, integer(2), integer(3))));
    Real to = smaller(larger(least, from), 1.0f);
    pieces = pieces + 1;
    if (pieces == kMostPieces) to = real(1.0f);
    Bool searched = AND(open, to > from);
    if (any(searched)) {
      VAR restP = 1.0f - from;
      VAR restQ = 1.0f - to;
      Weights wBegin;
      wBegin.w0 = between(wp.w0, wq.w0, from, restP);
      wBegin.w1 = between(wp.w1, wq.w1, from, restP);
      wBegin.w2 = between(wp.w2, wq.w2, from, restP);
      wBegin.w3 = between(wp.w3, wq.w3, from, restP);
      Weights wEnd;
      wEnd.w0 = between(wp.w0, wq.w0, to, restQ);
      wEnd.w1 = between(wp.w1, wq.w1, to, restQ);
      wEnd.w2 = between(wp.w2, wq.w2, to, restQ);
      wEnd.w3 = between(wp.w3, wq.w3, to, restQ);
      QuadraticForm q = bccForm(searched, brick, cellX, cellY, cellZ, t);
      Weights row = fixedAt(q, wBegin);
      Real b0 = weighted(wBegin, row);
      Real m = weighted(wEnd, row);
      Real b3 = weighted(wEnd, fixedAt(q, wEnd));
      VAR b1 = (b0 + (m + m)) * kThird;
      VAR b2 = ((m + m) + b3) * kThird;
      b0 = select(known, onSide(b0, side), b0);
      Real low;
      Real high;
      Bool found = isolate(searched, b0, b1, b2, b3, passing, low, high);
      if (any(found)) {
        h0 = select(found, b0, h0);
        h1 = select(found, b1, h1);
        h2 = select(found, b2, h2);
        h3 = select(found, b3, h3);
        foundLow = select(found, low, foundLow);
        foundHigh = select(found, high, foundHigh);
        begin = select(found, from, begin);
        end = select(found, to, end);
        crossing.found = OR(crossing.found, found);
        open = AND(open, NOT(found));
      }
      side = select(searched, b3 < 0.0f, side);
      known = OR(known, searched);
    }
    open = AND(open, to < 1.0f);
    stepAcross(t, open, face);
    from = to;
  }
  crossing.endsInside = side;
  if (any(crossing.found)) {
    Bool startsInside = blossom(h0, h1, h2, h3, foundLow, foundLow, foundLow) < 0.0f;
    Real within = bisect(h0, h1, h2, h3, startsInside, foundLow, foundHigh);
    VAR share = begin + within * (end - begin);
    crossing.share = share;
    crossing.enters = NOT(startsInside);
  }
  return crossing;
}

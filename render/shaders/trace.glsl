// Crossings of a ray with the zero set of the trilinear interpolant, and the traversal of cells for
// all filters. Types and coordinates are those of roots.glsl.

// Finds a crossing of a ray with the zero set between two points of a cell. Their coordinates run
// from 0 to 1 within the cell.
// @param brick, cellX …  the cell and the number of its brick, from spotAt()
// @param entered, left  axes of the faces through which the ray enters and leaves the cell, or
// kNone
// @param carried  true when the ray's side of the surface at the end of the previous cell is known
// @param inside  that side: true for inside
// @param passing  number of crossings to skip; crossings skipped in this cell are subtracted
Crossing crossingIn(Bool asked, Int brick, Int cellX, Int cellY, Int cellZ, Real x0, Real y0,
                    Real z0, Real x1, Real y1, Real z1, Int entered, Int left, Bool aheadX,
                    Bool aheadY, Bool aheadZ, Bool carried, Bool inside, INOUT(Int) passing) {
  CellValues f = cellValues(asked, brick, cellX, cellY, cellZ);
  Int signs = bit(f.f0 < 0.0f, 1) | bit(f.f1 < 0.0f, 2) | bit(f.f2 < 0.0f, 4) | bit(f.f3 < 0.0f, 8) |
                bit(f.f4 < 0.0f, 16) | bit(f.f5 < 0.0f, 32) | bit(f.f6 < 0.0f, 64) |
                bit(f.f7 < 0.0f, 128);

  // Along the ray's segment the trilinear interpolant is a cubic. Its Bernstein coefficients b0 …
  // b3 are values of its blossom.
  VAR rx0 = 1.0f - x0;
  VAR ry0 = 1.0f - y0;
  VAR rz0 = 1.0f - z0;
  VAR rx1 = 1.0f - x1;
  VAR ry1 = 1.0f - y1;
  VAR rz1 = 1.0f - z1;
  VAR g00 = between(f.f0, f.f4, x0, rx0);
  VAR g01 = between(f.f1, f.f5, x0, rx0);
  VAR g02 = between(f.f2, f.f6, x0, rx0);
  VAR g03 = between(f.f3, f.f7, x0, rx0);
  VAR g10 = between(f.f0, f.f4, x1, rx1);
  VAR g11 = between(f.f1, f.f5, x1, rx1);
  VAR g12 = between(f.f2, f.f6, x1, rx1);
  VAR g13 = between(f.f3, f.f7, x1, rx1);
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

  // Both cells at a face must agree if the ray is inside the solid where it crosses the face. If
  // all corners of the face have one sign, that sign decides; otherwise the side at the end of the
  // previous cell.
  Bool upperIn = select(entered == 0, NOT(aheadX), select(entered == 1, NOT(aheadY), NOT(aheadZ)));
  Bool upperOut = select(left == 0, aheadX, select(left == 1, aheadY, aheadZ));
  Int maskIn = faceCorners(entered, upperIn);
  Int maskOut = faceCorners(left, upperOut);
  Int in_ = signs & maskIn;
  Int out_ = signs & maskOut;
  Bool uniformIn = AND(entered != kNone, OR(in_ == 0, in_ == maskIn));
  Bool uniformOut = AND(left != kNone, OR(out_ == 0, out_ == maskOut));
  b0 = select(uniformIn, onSide(b0, in_ != 0), select(carried, onSide(b0, inside), b0));
  b3 = select(uniformOut, onSide(b3, out_ != 0), b3);

  Crossing crossing;
  Real low;
  Real high;
  crossing.found = isolate(asked, b0, b1, b2, b3, passing, low, high);
  crossing.endsInside = b3 < 0.0f;
  crossing.share = real(0.0f);
  crossing.enters = no();
  if (any(crossing.found)) {
    Bool startsInside = blossom(b0, b1, b2, b3, low, low, low) < 0.0f;
    crossing.share = bisect(b0, b1, b2, b3, startsInside, low, high);
    crossing.enters = NOT(startsInside);
  }
  return crossing;
}

struct Ray {
  Real ox, oy, oz;  // position at t = 0
  Real dx, dy, dz;  // direction: derivative of the position by t
  Real ix, iy, iz;  // 1 / direction, by component; kParallel for a component 0
  Real start, end;  // interval of t that is searched
};

// One component of the origin or direction of the ray through pixel (x, y) of a RayFan.
Real onFan(float middle, float right, float down, Real x, Real y) {
  VAR across = x * right + y * down;
  return across + middle;
}

// Replaces a tiny direction component by 0. A ray without motion along an axis counts as ascending
// and meets no plane across it: its inverse is kParallel, and its position on the axis does not
// change.
Real onlyFar(Real d) {
  return select(AND(d > -kLeastDirection, d < kLeastDirection), real(0.0f), d);
}

Real inverseOf(Real d) { return select(d == 0.0f, real(kParallel), quotient(real(1.0f), d)); }

// The ray through pixel (x, y), clipped to the box of the blocks that the surface crosses.
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
  Bool enters;
  Real t;
  Int x, y, z;  // cell of the hit
  Real inX, inY, inZ;  // position in the cell, from 0 to 1: the zero that was found, more exact than t
};

// Finds the first crossing of a ray with the surface after skipping `passing` crossings.
Hit trace(Ray ray, Int passing) {
  Bool aheadX = ray.dx >= 0.0f;
  Bool aheadY = ray.dy >= 0.0f;
  Bool aheadZ = ray.dz >= 0.0f;
  Hit hit;
  hit.found = no();
  hit.enters = no();
  hit.t = ray.start;
  hit.inX = real(0.0f);
  hit.inY = real(0.0f);
  hit.inZ = real(0.0f);
  Bool alive = ray.start <= ray.end;
  VAR t = ray.start;
  Int x = cellAt(t, ray.ox, ray.dx, ray.ix, integer(0), integer(tableSizeX - 1));
  Int y = cellAt(t, ray.oy, ray.dy, ray.iy, integer(0), integer(tableSizeY - 1));
  Int z = cellAt(t, ray.oz, ray.dz, ray.iz, integer(0), integer(tableSizeZ - 1));
  // A ray that starts outside the table begins on the entry face of its first cell in the table.
  t = larger(t, planeAt(select(aheadX, x, x + 1), ray.ox, ray.ix));
  t = larger(t, planeAt(select(aheadY, y, y + 1), ray.oy, ray.iy));
  t = larger(t, planeAt(select(aheadZ, z, z + 1), ray.oz, ray.iz));
  alive = AND(alive, t <= ray.end);
  Int entered = integer(kNone);
  Bool solved = no();    // the present cell was searched: the surface crosses it, but the ray has no further crossing in it
  Bool carried = no();   // the previous cell was searched, so `inside` is the side at its end
  Bool inside = no();    // side at the end of the last searched cell: true for inside
  while (any(alive)) {
    // Step to the next cell that the surface may cross.
    Bool walking = alive;
    Int brick = integer(0);
    Int axis = integer(kNone);
    VAR tExit = t;
    while (many(walking, alive)) {
      Spot spot = spotAt(walking, x, y, z);
      Bool stop = AND(spot.crosses, NOT(solved));
      Int size = spot.size;
      Int lowX = x & (integer(0) - size);
      Int lowY = y & (integer(0) - size);
      Int lowZ = z & (integer(0) - size);
      VAR tx = planeAt(select(aheadX, lowX + size, lowX), ray.ox, ray.ix);
      VAR ty = planeAt(select(aheadY, lowY + size, lowY), ray.oy, ray.iy);
      VAR tz = planeAt(select(aheadZ, lowZ + size, lowZ), ray.oz, ray.iz);
      Bool byX = AND(tx <= ty, tx <= tz);
      Bool byY = AND(NOT(byX), ty <= tz);
      Bool byZ = AND(NOT(byX), NOT(byY));
      Int out_ = select(byX, integer(0), select(byY, integer(1), integer(2)));
      VAR leaves = larger(t, select(byX, tx, select(byY, ty, tz)));
      Bool stopping = AND(walking, stop);
      brick = select(stopping, spot.brick, brick);
      axis = select(stopping, out_, axis);
      tExit = select(stopping, leaves, tExit);
      Bool moving = AND(walking, NOT(stop));
      t = select(moving, leaves, t);
      entered = select(moving, out_, entered);
      carried = select(moving, solved, carried);
      solved = AND(solved, NOT(moving));
      Bool leap = AND(moving, size > 1);
      Int nextX = select(aheadX, lowX + size, lowX - 1);
      Int nextY = select(aheadY, lowY + size, lowY - 1);
      Int nextZ = select(aheadZ, lowZ + size, lowZ - 1);
      Int stillX = x;
      Int stillY = y;
      Int stillZ = z;
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
    // Rays that were still stepping when the loop ended have not yet reached a crossed cell. They
    // continue in the next round.
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
      Crossing crossing;
      if (tetraDegree > 0)
        crossing = tetraCrossingIn(asked, brick, x, y, z, x0, y0, z0, x1, y1, z1, carried, inside, passing);
      else if (isBcc)
        crossing = bccCrossingIn(asked, brick, x, y, z, x0, y0, z0, x1, y1, z1, carried, inside, passing);
      else if (isSpline)
        crossing = splineCrossingIn(asked, x, y, z, x0, y0, z0, x1, y1, z1, carried, inside, passing);
      else
        crossing = crossingIn(asked, brick, x, y, z, x0, y0, z0, x1, y1, z1, entered, axis, aheadX,
                              aheadY, aheadZ, carried, inside, passing);
      VAR place = t + crossing.share * (tExit - t);
      Bool hits = AND(asked, AND(crossing.found, place <= ray.end));
      hit.found = OR(hit.found, hits);
      hit.enters = select(hits, crossing.enters, hit.enters);
      hit.t = select(hits, place, hit.t);
      VAR rest = 1.0f - crossing.share;
      hit.inX = select(hits, between(x0, x1, crossing.share, rest), hit.inX);
      hit.inY = select(hits, between(y0, y1, crossing.share, rest), hit.inY);
      hit.inZ = select(hits, between(z0, z1, crossing.share, rest), hit.inZ);
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

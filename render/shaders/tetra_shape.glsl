// Shape of a spline on the type-6 partition at a position: gradient and Hessian of the polynomial
// of its tetrahedron. Types and coordinates are those of roots.glsl.

// Computes the shape at a position. Along the axes X, Y, Z of a tetrahedron, the gradients of the
// barycentric coordinates are (−2, 0, 0), (2, −2, 0), (0, 1, 1) and (0, 1, −1).
// @param asked, cellX …  as for shapeAt()
Shape tetraShapeAt(Bool asked, Int cellX, Int cellY, Int cellZ, Real a, Real b, Real c) {
  Spot spot = spotAt(asked, cellX, cellY, cellZ);
  VAR x = a - 0.5f;
  VAR y = b - 0.5f;
  VAR z = c - 0.5f;
  Turn turn = turnAt(x, y, z);
  Weights w = weightsAt(x, y, z, turn);
  Cube data = turned(cubeData(asked, spot.brick, cellX, cellY, cellZ), turn);
  QuadraticForm q;
  if (tetraDegree == 2)
    q = quadraticForm(data);
  else
    q = fixedAt(cubicForm(data), w);
  float first = tetraDegree == 2 ? 4.0f : 6.0f;
  float second = tetraDegree == 2 ? 2.0f : 6.0f;
  Weights row = fixedAt(q, w);
  VAR gx = (row.w1 - row.w0) * first;
  VAR gy = ((row.w2 + row.w3) * 0.5f - row.w1) * first;
  VAR gz = (row.w2 - row.w3) * (0.5f * first);
  // Derivatives of the rows of the form along X, Y and Z.
  VAR hxx = (4.0f * ((q.q00 - (q.q01 + q.q01)) + q.q11)) * second;
  VAR hxy = (2.0f * (((q.q01 + q.q01) - (q.q11 + q.q11)) + ((q.q12 + q.q13) - (q.q02 + q.q03)))) * second;
  VAR hxz = (2.0f * ((q.q12 - q.q13) - (q.q02 - q.q03))) * second;
  VAR hyy = (4.0f * (q.q11 - (q.q12 + q.q13)) + ((q.q22 + q.q33) + (q.q23 + q.q23))) * second;
  VAR hyz = ((q.q22 - q.q33) - 2.0f * (q.q12 - q.q13)) * second;
  VAR hzz = ((q.q22 + q.q33) - (q.q23 + q.q23)) * second;
  // Back to the axes of the table.
  exchange(turn.yz, gy, gz);
  exchange(turn.yz, hyy, hzz);
  exchange(turn.yz, hxy, hxz);
  exchange(turn.xz, gx, gz);
  exchange(turn.xz, hxx, hzz);
  exchange(turn.xz, hxy, hyz);
  exchange(turn.xy, gx, gy);
  exchange(turn.xy, hxx, hyy);
  exchange(turn.xy, hxz, hyz);
  Shape shape;
  shape.gx = gx * turn.signX;
  shape.gy = gy * turn.signY;
  shape.gz = gz * turn.signZ;
  shape.hxx = hxx;
  shape.hyy = hyy;
  shape.hzz = hzz;
  shape.hxy = hxy * (turn.signX * turn.signY);
  shape.hxz = hxz * (turn.signX * turn.signZ);
  shape.hyz = hyz * (turn.signY * turn.signZ);
  shape.tx = shape.gx;
  shape.ty = shape.gy;
  shape.tz = shape.gz;
  shape.error = real(0.0f);
  return shape;
}

// Shape of the surface at the hit of a ray.
Shape shapeOf(IN(Hit) hit) {
  Shape shape;
  if (tetraDegree > 0)
    shape = tetraShapeAt(hit.found, hit.x, hit.y, hit.z, hit.inX, hit.inY, hit.inZ);
  else if (isBcc)
    shape = bccShapeAt(hit.found, hit.x, hit.y, hit.z, hit.inX, hit.inY, hit.inZ);
  else
    shape = shapeAt(hit.found, hit.x, hit.y, hit.z, hit.inX, hit.inY, hit.inZ);
  shape.inX = hit.inX;
  shape.inY = hit.inY;
  shape.inZ = hit.inZ;
  return shape;
}
